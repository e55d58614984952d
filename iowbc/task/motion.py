"""How the robot and the object move, seen from the heading frame: what reward, terminations and signals look at."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from iowbc.robot import rotations
from iowbc.sim.state import SimulationState
from iowbc.task.observation import to_heading

Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Motion:
    """The true state of n environments, reduced to what the task speaks of."""

    heading: Array
    """Yaw of the base, (n,) [rad]."""
    heading_frame: Array
    """The heading frame's quaternion, (n, 4)."""
    system_velocity: Array
    """v_sys, heading frame, (n, 3) [m/s]."""
    base_velocity: Array
    """Velocity of the pelvis, heading frame, (n, 3) [m/s]."""
    yaw_rate: Array
    """Turning of the base about the vertical, (n,) [rad/s]."""
    pelvis_height: Array
    """(n,) [m]."""
    height: Array
    """What the command's H speaks of: the pelvis, or the robot's centre of mass by recipe, (n,) [m]."""
    pelvis_tilt: Array
    """Angle of the pelvis from upright, (n,) [rad]."""
    torso_pitch: Array
    """Torso against gravity, positive leaning forward, (n,) [rad]."""
    torso_roll: Array
    """(n,) [rad]."""
    foot_position: Array
    """Soles from the base, heading frame, (n, 2, 3) [m]."""
    object_offset: Array
    """Object from the base, heading frame, (n, 3) [m]; zero without an object."""


def motion(state: SimulationState, height: Literal["pelvis", "com"] = "pelvis") -> Motion:
    """The motion in a simulation state; `height`: what H speaks of."""
    quaternion = state.base_quaternion
    frame = rotations.heading(quaternion)
    up = 1.0 - 2.0 * (quaternion[:, 1] ** 2 + quaternion[:, 2] ** 2)
    from_base = state.foot_position - state.base_position[:, None]
    to_object = (state.object_position - state.base_position) * state.has_object[:, None]
    return Motion(
        heading=rotations.yaw_of(quaternion),
        heading_frame=frame,
        system_velocity=to_heading(frame, state.system_velocity),
        base_velocity=to_heading(frame, state.base_linear_velocity),
        yaw_rate=rotations.rotate(quaternion, state.base_angular_velocity)[:, 2],
        pelvis_height=state.base_position[:, 2],
        height=state.base_position[:, 2] if height == "pelvis" else state.com_position[:, 2],
        pelvis_tilt=np.arccos(np.clip(up, -1.0, 1.0)),
        torso_pitch=rotations.lean_of(state.torso_quaternion),
        torso_roll=rotations.roll_of(state.torso_quaternion),
        foot_position=to_heading(frame, from_base),
        object_offset=to_heading(frame, to_object),
    )


def low_pass(filtered: Array, value: Array, time_constant: float, dt: float) -> Array:
    """One step of y' = (x − y)/T, any shape; exact for a value that is held over the step."""
    smoothed: Array = filtered + (1.0 - np.exp(-dt / time_constant)) * (value - filtered)
    return smoothed
