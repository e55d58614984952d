"""Privileged observation of the teacher, s_priv (paper III-C): one list of its parts about load, contact and forces.

To add a part, write a function that computes it from `Truth` and add a line to the list.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter

from iowbc.arrays import Array
from iowbc.control.layout import Part
from iowbc.robot import mirror
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
    Part("object_mass", mirror.scalar, "kg", "-", _drawn("object_mass")),
    Part("object_com_offset", mirror.polar_vector, "m", "object", _drawn("object_com_offset")),
    Part("inertia_scale", mirror.scalar, "1", "-", _drawn("inertia_scale")),
    Part("ground_friction", mirror.scalar, "1", "-", _drawn("ground_friction")),
    Part("object_ground_friction", mirror.scalar, "1", "-", _drawn("object_ground_friction")),
    Part("surface_friction", mirror.scalar, "1", "-", _drawn("surface_friction")),
    Part("base_linear_velocity", mirror.polar_vector, "m/s", "heading", attrgetter("motion.base_velocity")),
    Part("system_velocity", mirror.polar_vector, "m/s", "heading", attrgetter("motion.system_velocity")),
    Part("pelvis_height", mirror.scalar, "m", "-", attrgetter("motion.pelvis_height")),
    Part("foot_force", mirror.polar_vector_each_side, "N", "heading", attrgetter("motion.foot_force")),
    Part("external_force", mirror.polar_vector, "N", "heading", attrgetter("motion.external_force")),
    Part("external_torque", mirror.axial_vector, "N·m", "heading", attrgetter("motion.external_torque")),
    Part("push_force", mirror.polar_vector, "N", "heading", attrgetter("motion.push_force")),
    Part("link_object_force", mirror.scalar, "N", "-", attrgetter("state.link_object_force")),
    Part("hand_weight_share", mirror.scalar, "1", "-", attrgetter("state.hand_weight_share")),
    Part("rolling_resistance", mirror.scalar, "N", "-", _drawn("rolling_resistance")),
    Part("motor_effort", mirror.joint_magnitude, "N·m", "joint", attrgetter("motor_effort")),
    Part("encoder_bias", mirror.joint_mirror, "rad", "joint", _drawn("encoder_bias")),
    Part("imu_tilt", mirror.roll_and_pitch, "rad", "base", _drawn("imu_tilt")),
    Part("gyro_bias", mirror.axial_vector, "rad/s", "base", _drawn("gyro_bias")),
    Part("sensor_latency", mirror.scalar, "control periods", "-", _drawn("sensor_latency")),
    Part("partner_share", mirror.scalar, "1", "-", _drawn("partner_share")),
    Part("action_latency", mirror.scalar, "control periods", "-", _drawn("action_latency")),
)
"""Parts of s_priv, in order; user-defined ones follow."""
