"""The observation s_t (paper eq. 5): one list of its parts, from which layout, mirror, graph and contract follow.

To add a part, write a function that computes it from `PolicyInputs` and add a line to the list. The function receives
NumPy arrays in simulation and torch tensors in the export of the graph, so it may only use operators.
"""

import math
from dataclasses import dataclass
from operator import attrgetter

from iowbc.arrays import Array
from iowbc.control.command import command_mirror
from iowbc.control.gait import phase_mirror
from iowbc.control.layout import Layout, Part
from iowbc.control.sensors import Measured
from iowbc.robot.description import Robot
from iowbc.robot.mirror import axial_vector, interaction_mirror, joint_mirror, polar_vector, support_mirror, turn


@dataclass(frozen=True)
class PolicyInputs:
    """Measurements and control state of n robots, from which the parts of s_t are computed."""

    measured: Measured
    command: Array
    """C, (n, 11), as commanded at this step."""
    heading_reference: Array
    """Measured heading at the start plus the integrated commanded yaw rate, (n, 1) [rad]."""
    joint_reference: Array
    """θ_ref of all joints in MJCF order, without the residual, (n, joints) [rad]."""
    phase: Array
    """(sin, cos) of the gait phase, zero when standing, (n, 2)."""
    last_action: Array
    """a_{t−1}, (n, support joints)."""
    support_reference: Array
    """θ_S_ref with the gait prior, (n, support joints) [rad]."""
    arm_reference: Array
    """θ_I_ref, (n, arm joints) [rad]."""


def joint_deviation(sensed: PolicyInputs) -> Array:
    """Joint positions relative to their references, (n, joints) [rad]."""
    return sensed.measured.joint_position - sensed.joint_reference


def heading_error(sensed: PolicyInputs) -> Array:
    """Heading of the base less its reference, in [-π, π), (n, 1) [rad]; the yaw among the paper's Φ_b."""
    return (sensed.measured.heading - sensed.heading_reference + math.pi) % (2.0 * math.pi) - math.pi


def object_orientation(sensed: PolicyInputs) -> Array:
    """Vector part of the object's quaternion with a positive scalar part: axis · sin(angle/2), (n, 3)."""
    quaternion = sensed.measured.object_quaternion
    assert quaternion is not None, "a layout with the object is filled with the object's pose"
    return quaternion[:, 1:] * (1.0 - 2.0 * (quaternion[:, :1] < 0.0))


PROPRIOCEPTION: tuple[Part[PolicyInputs], ...] = (
    Part("command", command_mirror, "m/s, m/s, rad/s, m, rad, m x 6", "heading", attrgetter("command")),
    Part("projected_gravity", polar_vector, "1", "base", attrgetter("measured.projected_gravity")),
    Part("base_angular_velocity", axial_vector, "rad/s", "base", attrgetter("measured.base_angular_velocity")),
    Part("heading_error", turn, "rad", "world", heading_error),
    Part("joint_position", joint_mirror, "rad", "joint", joint_deviation),
    Part("joint_velocity", joint_mirror, "rad/s", "joint", attrgetter("measured.joint_velocity")),
    Part("phase", phase_mirror, "1", "-", attrgetter("phase")),
    Part("last_action", support_mirror, "action", "joint", attrgetter("last_action")),
    Part("support_reference", support_mirror, "rad", "joint", attrgetter("support_reference")),
    Part("arm_reference", interaction_mirror, "rad", "joint", attrgetter("arm_reference")),
)
"""Parts of s_t without the object, in order. Units are SI; the learner's normalisation scales them."""
OBJECT: tuple[Part[PolicyInputs], ...] = (
    Part("object_position", polar_vector, "m", "base", attrgetter("measured.object_position")),
    Part("object_orientation", axial_vector, "1", "base", object_orientation),
    Part("object_linear_velocity", polar_vector, "m/s", "base", attrgetter("measured.object_linear_velocity")),
    Part("object_angular_velocity", axial_vector, "rad/s", "base", attrgetter("measured.object_angular_velocity")),
)
"""Parts of s_t that describe the object."""

ObservationLayout = Layout[PolicyInputs]


def observation_layout(robot: Robot, observe_object: bool) -> ObservationLayout:
    return Layout(PROPRIOCEPTION + OBJECT if observe_object else PROPRIOCEPTION, robot)
