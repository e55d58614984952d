"""What the teacher alone sees (paper III-C: s_priv): the truth about load, contact and forces."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.task.motion import Motion

Array = NDArray[np.floating[Any]]

DRAWN = (
    *("object_mass", "object_com_offset", "inertia_scale", "ground_friction", "object_ground_friction"),
    *("surface_friction", "partner_share", "action_latency"),
)
"""Drawn quantities that are privileged observations under their own names."""


def privileged(moved: Motion, drawn: Mapping[str, Array]) -> dict[str, Array]:
    """The parts of s_priv by name, each (n, k): vectors in the heading frame, SI units."""
    values = {name: drawn[name].reshape(len(moved.heading), -1) for name in DRAWN}
    return values | {
        "base_linear_velocity": moved.base_velocity,
        "system_velocity": moved.system_velocity,
        "pelvis_height": moved.pelvis_height[:, None],
        "foot_force": moved.foot_force.reshape(-1, 6),
        "external_force": moved.external_force,
        "external_torque": moved.external_torque,
    }
