"""Privileged observation of the teacher, s_priv (paper III-C): one list of its parts about load, contact and forces.

To add a part, write a function that computes it from `Truth` and add a line to the list.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

from iowbc.arrays import Array
from iowbc.control.layout import Layout, Part
from iowbc.robot.description import Robot
from iowbc.robot.mirror import (
    axial_vector,
    joint_magnitude,
    joint_mirror,
    polar_vector,
    polar_vector_each_side,
    roll_and_pitch,
    scalar,
)
from iowbc.sim.state import SimulationState
from iowbc.task.motion import Motion


@dataclass(frozen=True)
class Truth:
    """True state of n environments, from which the parts of s_priv are computed."""

    motion: Motion
    state: SimulationState
    drawn: Mapping[str, Array]
    """Drawn quantities by name, (n,) or (n, k)."""
    motor_effort: Array
    """Torque limit of each motor or linkage in the episode at low speed, (n, joints) [N·m]."""


def _drawn(name: str) -> Callable[[Truth], Array]:
    return lambda truth: truth.drawn[name]


PRIVILEGED: tuple[Part[Truth], ...] = (
    Part("object_mass", scalar, "kg", "-", _drawn("object_mass")),
    Part("object_com_offset", polar_vector, "m", "object", _drawn("object_com_offset")),
    Part("inertia_scale", scalar, "1", "-", _drawn("inertia_scale")),
    Part("ground_friction", scalar, "1", "-", _drawn("ground_friction")),
    Part("object_ground_friction", scalar, "1", "-", _drawn("object_ground_friction")),
    Part("surface_friction", scalar, "1", "-", _drawn("surface_friction")),
    Part("base_linear_velocity", polar_vector, "m/s", "heading", attrgetter("motion.base_velocity")),
    Part("system_velocity", polar_vector, "m/s", "heading", attrgetter("motion.system_velocity")),
    Part("pelvis_height", scalar, "m", "-", attrgetter("motion.pelvis_height")),
    Part("foot_force", polar_vector_each_side, "N", "heading", attrgetter("motion.foot_force")),
    Part("external_force", polar_vector, "N", "heading", attrgetter("motion.external_force")),
    Part("external_torque", axial_vector, "N·m", "heading", attrgetter("motion.external_torque")),
    Part("push_force", polar_vector, "N", "heading", attrgetter("motion.push_force")),
    Part("link_object_force", scalar, "N", "-", attrgetter("state.link_object_force")),
    Part("hand_weight_share", scalar, "1", "-", attrgetter("state.hand_weight_share")),
    Part("rolling_resistance", scalar, "N", "-", _drawn("rolling_resistance")),
    Part("motor_effort", joint_magnitude, "N·m", "joint", attrgetter("motor_effort")),
    Part("encoder_bias", joint_mirror, "rad", "joint", _drawn("encoder_bias")),
    Part("imu_tilt", roll_and_pitch, "rad", "base", _drawn("imu_tilt")),
    Part("gyro_bias", axial_vector, "rad/s", "base", _drawn("gyro_bias")),
    Part("sensor_latency", scalar, "control periods", "-", _drawn("sensor_latency")),
    Part("partner_share", scalar, "1", "-", _drawn("partner_share")),
    Part("action_latency", scalar, "control periods", "-", _drawn("action_latency")),
)
"""Parts of s_priv, in order."""

PrivilegedLayout = Layout[Truth]


def privileged_layout(robot: Robot, own: Sequence[Part[Truth]] = ()) -> PrivilegedLayout:
    """Layout of s_priv; `own`: user-defined parts, which come last."""
    return Layout((*PRIVILEGED, *own), robot)
