"""What the teacher alone sees (paper III-C: s_priv): the truth about load, contact and forces."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.robot import rotations
from iowbc.sim.state import SimulationState
from iowbc.task.observation import to_heading

Array = NDArray[np.floating[Any]]

DRAWN = (
    *("object_mass", "object_com_offset", "inertia_scale", "ground_friction", "object_ground_friction"),
    *("surface_friction", "partner_share", "action_latency"),
)
"""Drawn quantities that are privileged observations under their own names."""


def privileged(state: SimulationState, drawn: Mapping[str, Array]) -> dict[str, Array]:
    """The parts of s_priv by name, each (n, k): vectors in the heading frame, SI units."""
    frame = rotations.heading(state.base_quaternion)
    values = {name: drawn[name].reshape(len(frame), -1) for name in DRAWN}
    return values | {
        "base_linear_velocity": to_heading(frame, state.base_linear_velocity),
        "system_velocity": to_heading(frame, state.system_velocity),
        "pelvis_height": state.base_position[:, 2:],
        "foot_force": to_heading(frame, state.foot_force).reshape(-1, 6),
        "external_force": to_heading(frame, state.external_force[:, :3]),
        "external_torque": to_heading(frame, state.external_force[:, 3:]),
    }
