"""Motion of robot and object in the heading frame: the input of reward, terminations and signals."""

from typing import Literal

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations
from iowbc.robot.rotations import TINY
from iowbc.sim.state import SimulationState


class Motion:
    """The true state of n environments, reduced to the quantities of the task. Vectors are in the heading frame."""

    def __init__(self, state: SimulationState, height: Literal["pelvis", "com"]) -> None:
        """`height`: of the pelvis or the centre of mass, as H commands it."""
        rotation, base = state.base_rotation, state.base_position
        vectors = np.empty((len(base), 11, 3))
        vectors[:, 0] = state.system_velocity
        vectors[:, 1] = state.base_linear_velocity
        np.subtract(state.foot_position, base[:, None], out=vectors[:, 2:4])
        vectors[:, 4:6] = state.foot_force
        np.subtract(state.object_position, base, out=vectors[:, 6])
        vectors[:, 6] *= state.has_object[:, None]
        vectors[:, 7:9] = state.external_force.reshape(-1, 2, 3)
        vectors[:, 9] = state.push_force
        np.add(state.grip_force[:, 0], state.grip_force[:, 1], out=vectors[:, 10])
        to_heading(rotation, vectors)
        self.heading = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
        """Yaw of the base, (n,) [rad]."""
        self.system_velocity = vectors[:, 0]
        """v_sys, (n, 3) [m/s]."""
        self.base_velocity = vectors[:, 1]
        """Velocity of the pelvis, (n, 3) [m/s]."""
        self.yaw_rate = np.vecdot(rotation[:, 2], state.base_angular_velocity)
        """Yaw rate of the base, (n,) [rad/s]."""
        self.pelvis_height = base[:, 2]
        """(n,) [m]."""
        self.height = base[:, 2] if height == "pelvis" else state.com_position[:, 2]
        """Height that H commands: of the pelvis or the robot's centre of mass, by recipe, (n,) [m]."""
        self.pelvis_tilt = np.arccos(rotation[:, 2, 2].clip(-1.0, 1.0))
        """Angle of the pelvis from upright, (n,) [rad]."""
        self.torso_pitch = rotations.lean_of(state.torso_rotation)
        """Torso against gravity, positive leaning forward, (n,) [rad]."""
        self.torso_roll = rotations.side_tilt_of(state.torso_rotation)
        """Tilt of the torso to a side, positive to the right, (n,) [rad]."""
        self.foot_position = vectors[:, 2:4]
        """Soles relative to the base, (n, 2, 3) [m]."""
        self.foot_force = vectors[:, 4:6]
        """Force of the ground on each foot, (n, 2, 3) [N]."""
        self.object_offset = vectors[:, 6]
        """Object relative to the base, (n, 3) [m]; zero without an object."""
        self.hand_force = vectors[:, 10]
        """Force of the object on both hands together, (n, 3) [N]."""
        self.external_force = vectors[:, 7]
        """Force of partner and impulses on the object, (n, 3) [N]."""
        self.external_torque = vectors[:, 8]
        """Their torque about the object's centre of mass, (n, 3) [N·m]."""
        self.push_force = vectors[:, 9]
        """Force of pushes on the base, (n, 3) [N]."""


def to_heading(rotation: Array, vectors: Array) -> None:
    """Turns world vectors (n, k, 3) in place into the heading frame of bases with these rotations (n, 3, 3)."""
    forward = rotation[:, :2, 0]
    cosine, sine = (forward / np.maximum(np.hypot(forward[:, 0], forward[:, 1]), TINY)[:, None]).T[..., None]
    x, y = vectors[..., 0], vectors[..., 1]
    ahead = cosine * x
    ahead += sine * y
    y *= cosine
    y -= sine * x
    x[:] = ahead


def low_pass(filtered: Array, value: Array, time_constant: float, dt: float) -> Array:
    """One step of y' = (x − y)/T, any shape; exact for a value that is held over the step."""
    return filtered + (1.0 - np.exp(-dt / time_constant)) * (value - filtered)
