"""Inputs of the physics for a control period, and the true state after it, without sensor errors."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array, Indices


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
        return type(self)(**{name: values[place] for name, values in vars(self).items()})


class SimulationState:
    """The true state after a control period, in arrays that are overwritten. World frame unless said otherwise;
    quaternions wxyz.

    Forces, torques, accelerations are those of the last physics step; all else is of the state that it led to.
    """

    def __init__(self, n: int, joints: int) -> None:
        """Arrays for n environments of a robot with so many joints, upright at the origin."""
        self.base_position = np.zeros((n, 3))
        """Pelvis, (n, 3) [m]."""
        self.base_quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        """(n, 4)."""
        self.base_rotation = np.zeros((n, 3, 3))
        """Rotation matrix of the base, (n, 3, 3)."""
        self.base_linear_velocity = np.zeros((n, 3))
        """(n, 3) [m/s]."""
        self.base_angular_velocity = np.zeros((n, 3))
        """Base frame, (n, 3) [rad/s]."""
        self.joint_position = np.zeros((n, joints))
        """MJCF order, (n, joints) [rad]."""
        self.joint_velocity = np.zeros((n, joints))
        """(n, joints) [rad/s]."""
        self.joint_acceleration = np.zeros((n, joints))
        """Mean over the control period, (n, joints) [rad/s²]."""
        self.joint_torque = np.zeros((n, joints))
        """Torque of the motors, (n, joints) [N·m]."""
        self.torque_limit = np.zeros((n, joints))
        """Torque limits of the motors in that direction in this control period, (n, joints) [N·m]."""
        self.saturation = np.zeros((n, joints), np.bool_)
        """Motors at that limit, (n, joints)."""
        self.torso_rotation = np.zeros((n, 3, 3))
        """Rotation matrix of the torso, (n, 3, 3)."""
        self.com_position = np.zeros((n, 3))
        """The robot's own centre of mass, (n, 3) [m]."""
        self.system_velocity = np.zeros((n, 3))
        """v_sys: velocity of the common centre of mass of robot and object (held, or crate), (n, 3) [m/s]."""
        self.foot_position = np.zeros((n, 2, 3))
        """Sole centres, left and right, (n, 2, 3) [m]."""
        self.foot_velocity = np.zeros((n, 2, 3))
        """Velocity of the sole centres, (n, 2, 3) [m/s]."""
        self.foot_force = np.zeros((n, 2, 3))
        """Contact force on each foot, of the ground and of whatever else it touches, (n, 2, 3) [N]."""
        self.foot_contact = np.zeros((n, 2), np.bool_)
        """(n, 2)."""
        self.has_object = np.zeros(n, np.bool_)
        """(n,)."""
        self.object_position = np.zeros((n, 3))
        """Object's centre, (n, 3) [m]; zero without an object."""
        self.object_quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        """(n, 4); identity without an object."""
        self.object_linear_velocity = np.zeros((n, 3))
        """Velocity of the object's centre, (n, 3) [m/s]."""
        self.object_angular_velocity = np.zeros((n, 3))
        """(n, 3) [rad/s]."""
        self.grasped = np.zeros((n, 2), np.bool_)
        """Hands (left, right) that hold the object, or touch it where there is nothing to hold, (n, 2)."""
        self.slipped = np.zeros((n, 2), np.bool_)
        """Hands that let go in this control period, (n, 2)."""
        self.grip_force = np.zeros((n, 2, 3))
        """Force of the object on each hand, (n, 2, 3) [N]."""
        self.hand_weight_share = np.zeros(n)
        """Vertical force of the hands on a held object as a fraction of its weight, (n,); zero with nothing to hold."""
        self.link_object_force = np.zeros(n)
        """Size of the force of links other than the hands, or of the ground, on the object, (n,) [N]."""
        self.partner_force = np.zeros((n, 3))
        """Force of the partner on the object, (n, 3) [N]."""
        self.partner_velocity = np.zeros((n, 3))
        """Velocity that the partner intends for the handle, (n, 3) [m/s]; zero without a partner."""
        self.handle_velocity = np.zeros((n, 3))
        """Velocity of the object's far handle, which a partner holds, (n, 3) [m/s]; zero without an object."""
        self.partner_share = np.zeros(n)
        """Share of the weight, or in a push of the rolling resistance, that the partner bears at the time, (n,)."""
        self.external_force = np.zeros((n, 6))
        """Force and torque of partner and impulses on the object about its centre of mass, (n, 6) [N, N·m]."""
        self.push_force = np.zeros((n, 3))
        """Force of pushes on the base, (n, 3) [N]."""
        self.diverged = np.zeros(n, np.bool_)
        """Simulation diverged in this control period and is back in the state before it; to be reset, (n,)."""
