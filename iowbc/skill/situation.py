"""State of the games for observations and reward: objects on their paths, start frame."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.robot.rotations import rotate, turned, wrapped
from iowbc.sim.simulation import Simulation
from iowbc.skill.path import Paths
from iowbc.task.motion import Motion


@dataclass(frozen=True)
class Origin:
    """Start frames, in which paths are defined: the object's centre and the robot's heading at the start."""

    position: Array
    """(n, 3) [m]."""
    heading: Array
    """(n,) [rad]."""

    def turned(self, vectors: Array) -> Array:
        """World vectors (n, 3) or planar ones (n, 2) in these frames."""
        return turned(vectors, -self.heading)


@dataclass(frozen=True)
class GameState:
    """n games at one time; positions and velocities (n, 3) in the start frame, the others (n,); SI units."""

    path: Indices
    """Numbers of the paths, (n,)."""
    position: Array
    """Object's centre."""
    yaw: Array
    yaw_rate: Array
    tilt: Array
    """Of the object; the tilt from upright."""
    handle: Array
    handle_velocity: Array
    """Far handle."""
    heading: Array
    """Heading of the robot."""
    base: Array
    """Pelvis."""
    covered: Array
    """Arc length that the object has covered."""
    lateral: Array
    """Distance of the object from its path, positive to the left."""
    yaw_error: Array
    height_error: Array
    """Yaw and height of the object less the path's heading and height."""
    left: Array
    """Remaining arc length."""


def situation(
    simulation: Simulation, moved: Motion, origin: Origin, paths: Paths, path: Indices, covered: Array
) -> GameState:
    """State after a control step; `covered` (n,): arc length at an earlier time [m]."""
    state = simulation.state
    position = origin.turned(state.object_position - origin.position)
    forward, up = (rotate(state.object_quaternion, np.tile(axis, (simulation.n, 1))) for axis in np.eye(3)[::2])
    yaw = wrapped(np.arctan2(forward[:, 1], forward[:, 0]) - origin.heading)
    covered, lateral = paths.place(path, position[:, :2], covered)
    return GameState(
        path=path,
        position=position,
        yaw=yaw,
        yaw_rate=state.object_angular_velocity[:, 2].copy(),
        tilt=np.arccos(up[:, 2].clip(-1.0, 1.0)),
        handle=origin.turned(simulation.partner.at - origin.position),
        handle_velocity=origin.turned(state.handle_velocity),
        heading=wrapped(moved.heading - origin.heading),
        base=origin.turned(state.base_position - origin.position),
        covered=covered,
        lateral=lateral,
        yaw_error=wrapped(yaw - paths.heading(path, covered)),
        height_error=position[:, 2] - paths.height(path, covered),
        left=paths.length[path] - covered,
    )
