"""Inputs of the physics for a control period, and the true state after it, without sensor errors."""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from iowbc.arrays import Array, Indices, Mask


@dataclass(frozen=True)
class Period:
    """Inputs of n environments, held over a control period."""

    target: Array
    """Targets of the joint controllers, (n, joints) [rad]."""
    effort: Array
    """Least and greatest torque of each motor, (n, joints, 2) [N·m]."""
    wrench: Array
    """Force and torque on the object about its centre of mass, (n, 6) [N, N·m]."""
    push: Array
    """Force on the base's centre of mass, (n, 3) [N]."""
    resistance: Array
    """Rolling resistance of a crate's wheels, (n,) [N]."""
    squeeze: Array
    """Force with which the arms press each hand against the object, (n,) [N]."""
    slip_force: Array
    """Force at which a hand slips in a compliant grasp, (n,) [N]."""

    def rows(self, place: slice | Indices) -> Self:
        """The inputs of some environments."""
        return type(self)(**{name: values[place] for name, values in vars(self).items()})


@dataclass(frozen=True)
class SimulationState:
    """The true state after a control period, in arrays that are overwritten. World frame unless said otherwise;
    quaternions wxyz.

    Forces, torques, accelerations are those of the last physics step; all else is of the state that it led to.
    """

    base_position: Array
    """Pelvis, (n, 3) [m]."""
    base_quaternion: Array
    """(n, 4)."""
    base_rotation: Array
    """Rotation matrix of the base, (n, 3, 3)."""
    base_linear_velocity: Array
    """(n, 3) [m/s]."""
    base_angular_velocity: Array
    """Base frame, (n, 3) [rad/s]."""
    joint_position: Array
    """MJCF order, (n, joints) [rad]."""
    joint_velocity: Array
    """(n, joints) [rad/s]."""
    joint_acceleration: Array
    """Mean over the control period, (n, joints) [rad/s²]."""
    joint_torque: Array
    """Torque of the motors, (n, joints) [N·m]."""
    torque_limit: Array
    """Torque limits of the motors in that direction in this control period, (n, joints) [N·m]."""
    saturation: Mask
    """Motors at that limit, (n, joints)."""
    torso_rotation: Array
    """Rotation matrix of the torso, (n, 3, 3)."""
    com_position: Array
    """The robot's own centre of mass, (n, 3) [m]."""
    system_velocity: Array
    """v_sys: velocity of the common centre of mass of robot and object (held, or crate), (n, 3) [m/s]."""
    foot_position: Array
    """Sole centres, left and right, (n, 2, 3) [m]."""
    foot_velocity: Array
    """Velocity of the sole centres, (n, 2, 3) [m/s]."""
    foot_force: Array
    """Contact force on each foot, of the ground and of whatever else it touches, (n, 2, 3) [N]."""
    foot_contact: Mask
    """(n, 2)."""
    has_object: Mask
    """(n,)."""
    object_position: Array
    """Object's centre, (n, 3) [m]; zero without an object."""
    object_quaternion: Array
    """(n, 4); identity without an object."""
    object_linear_velocity: Array
    """Velocity of the object's centre, (n, 3) [m/s]."""
    object_angular_velocity: Array
    """(n, 3) [rad/s]."""
    grasped: Mask
    """Hands (left, right) that hold the object, or touch it where there is nothing to hold, (n, 2)."""
    slipped: Mask
    """Hands that let go in this control period, (n, 2)."""
    grip_force: Array
    """Force of the object on each hand, (n, 2, 3) [N]."""
    hand_weight_share: Array
    """Vertical force of the hands on a held object as a fraction of its weight, (n,); zero with nothing to hold."""
    link_object_force: Array
    """Size of the force of links other than the hands, or of the ground, on the object, (n,) [N]."""
    partner_force: Array
    """Force of the partner on the object, (n, 3) [N]."""
    partner_velocity: Array
    """Velocity that the partner intends for the handle, (n, 3) [m/s]; zero without a partner."""
    handle_velocity: Array
    """Velocity of the object's far handle, which a partner holds, (n, 3) [m/s]; zero without an object."""
    partner_share: Array
    """Share of the weight, or in a push of the rolling resistance, that the partner bears at the time, (n,)."""
    partner_energy: Array
    """Work of the partner on the object since the reset, (n,) [J]."""
    external_force: Array
    """Force and torque of partner and impulses on the object about its centre of mass, (n, 6) [N, N·m]."""
    push_force: Array
    """Force of pushes on the base, (n, 3) [N]."""
    diverged: Mask
    """Simulation diverged in this control period and is back in the state before it; to be reset, (n,)."""

    @classmethod
    def empty(cls, n: int, joints: int) -> Self:
        """Arrays for n environments of a robot with so many joints, upright at the origin."""
        mask: dict[str, tuple[int, ...]] = dict.fromkeys(("foot_contact", "grasped", "slipped"), (2,))
        mask |= {"saturation": (joints,), "has_object": (), "diverged": ()}
        of_joints = ("joint_position", "joint_velocity", "joint_acceleration", "joint_torque", "torque_limit")
        of_sides = ("foot_position", "foot_velocity", "foot_force", "grip_force")
        single = ("hand_weight_share", "link_object_force", "partner_energy", "partner_share")
        real: dict[str, tuple[int, ...]] = dict.fromkeys(of_joints, (joints,)) | dict.fromkeys(of_sides, (2, 3))
        real |= dict.fromkeys(single, ()) | dict.fromkeys(("base_quaternion", "object_quaternion"), (4,))
        real |= dict.fromkeys(("base_rotation", "torso_rotation"), (3, 3)) | {"external_force": (6,)}
        arrays: dict[str, Any] = {}
        for field in fields(cls):
            if field.name in mask:
                arrays[field.name] = np.zeros((n, *mask[field.name]), bool)
            else:
                arrays[field.name] = np.zeros((n, *real.get(field.name, (3,))))
            if field.name.endswith("quaternion"):
                arrays[field.name][:, 0] = 1.0
        return cls(**arrays)
