"""Sensor measurements: the measured inputs of the observation, with their size, unit, frame and mirror map."""

from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Annotated, cast, get_type_hints

from iowbc.arrays import Array, namespace
from iowbc.robot.mirror import Kind, axial_vector, joint_mirror, polar_vector, rotation, turn


@dataclass(frozen=True)
class Quantity:
    """Meaning of an array of the control loop, with one row per robot."""

    kind: Kind
    """Its mirror map, whose length is its size."""
    unit: str
    frame: str
    """Frame in which the values are given; "joint" for joint coordinates, "-" where there is none."""
    meaning: str


@dataclass(frozen=True)
class Measured:
    """Sensor measurements of n robots: vectors (n, 3), `heading` (n, 1), joints (n, joints), a quaternion (n, 4).
    `heading` may drift slowly; an object's are needed where the policy observes it, its position zero without one."""

    projected_gravity: Annotated[
        Array, Quantity(polar_vector, "1", "base", "direction of gravity; (0, 0, -1) when upright")
    ]
    base_angular_velocity: Annotated[Array, Quantity(axial_vector, "rad/s", "base", "gyroscope")]
    heading: Annotated[Array, Quantity(turn, "rad", "world", "yaw of the base from any origin, by the inertial unit")]
    joint_position: Annotated[Array, Quantity(joint_mirror, "rad", "joint", "all joints, in the order of `joints`")]
    joint_velocity: Annotated[Array, Quantity(joint_mirror, "rad/s", "joint", "all joints, in the order of `joints`")]
    object_position: Annotated[Array | None, Quantity(polar_vector, "m", "base", "object's origin from the base")] = (
        None
    )
    object_quaternion: Annotated[Array | None, Quantity(rotation, "1", "base", "object's orientation, wxyz")] = None
    object_linear_velocity: Annotated[
        Array | None, Quantity(polar_vector, "m/s", "base", "object's velocity relative to the base")
    ] = None
    object_angular_velocity: Annotated[
        Array | None, Quantity(axial_vector, "rad/s", "base", "object's angular velocity relative to the base")
    ] = None

    @property
    def pitch(self) -> Array:
        """Pitch of the base by the direction of gravity in its sagittal plane, (n,) [rad]."""
        gravity = self.projected_gravity
        return cast(Array, namespace(gravity).arctan2(gravity[:, 0], -gravity[:, 2]))


@cache
def quantities(of_object: bool) -> dict[str, Quantity]:
    """The measured quantities by name: those of the robot, or those of the object."""
    hints = get_type_hints(Measured, include_extras=True)
    chosen = [field.name for field in fields(Measured) if (field.default is not MISSING) == of_object]
    return {name: hints[name].__metadata__[0] for name in chosen}
