"""What robot, human and centralised critic observe of a game: parts by name, which are joined in order."""

from collections.abc import Mapping

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.skill.skill import Skill
from iowbc.robot import rotations
from iowbc.sim.simulation import Simulation
from iowbc.sim.state import MeasuredState
from iowbc.skill.path import Paths
from iowbc.skill.situation import Situation, turned, wrapped
from iowbc.task.motion import Motion

FORCE = 50.0
"""Forces are observed in this unit [N], so that parts are of the size of one."""
TIME = 10.0
"""The same for times and ways left [s, m]."""
DRAWN = {"partner_stiffness": 300.0, "partner_damping": 50.0, "partner_delay": 0.3, "partner_noise": 8.0}
DRAWN |= {"partner_pace": 1.0, "partner_share": 1.0, "object_mass": 20.0, "object_ground_friction": 0.1}
"""Quantities of the simulation that the critic sees, with their units."""
SENSED, FELT = 44, 28
"""Size of what the robot observes beside the estimated forces, and of what the human observes."""
HIDDEN = 13 + len(BEHAVIOURS) + len(DRAWN)


def sizes(skill: Skill) -> tuple[tuple[str, int], ...]:
    """Sizes of what "robot" and "human" observe, and of the "state" that the centralised critic sees: both, and what is
    hidden from them."""
    robot = SENSED + 6 * skill.robot.history
    return ("robot", robot), ("human", FELT), ("state", robot + FELT + HIDDEN)


def joined(parts: Mapping[str, Array]) -> Array:
    """Parts (n, k) or (n,) side by side, (n, sum of k) float32."""
    columns = [values if values.ndim == 2 else values[:, None] for values in parts.values()]
    return np.concatenate(columns, axis=1).astype(np.float32)


def sensed(command: Array, measured: MeasuredState, wrist_error: Array, sees_object: bool) -> dict[str, Array]:
    """What a robot senses, heading frame: `command` (n, 11), `wrist_error` (n, 2, 3) [m]; without `sees_object` the
    object's part is zero."""
    parts = {
        "command": command,
        "gravity": measured.projected_gravity,
        "rates": measured.base_angular_velocity,
        "wrist_error": 10.0 * wrist_error.reshape(-1, 6),
    }
    level = leveling(measured.projected_gravity)
    forward, up = _axes(measured)
    vectors = [measured.object_position, forward, up, measured.object_linear_velocity, measured.object_angular_velocity]
    place, forward, up, velocity, rates = (_turned(level, vector) for vector in vectors)
    of_object = [place, _yaw(forward)[:, None], up[:, :2], velocity, rates[:, 2:]]
    return parts | {"object": np.concatenate(of_object, axis=1) * sees_object}


def object_yaw(measured: MeasuredState) -> Array:
    """Measured yaw of the object in the heading frame, (n,) [rad]."""
    return _yaw(_turned(leveling(measured.projected_gravity), _axes(measured)[0]))


def _axes(measured: MeasuredState) -> list[Array]:
    """The object's forward and upward axes in the base frame, (n, 3) each."""
    quaternion = measured.object_quaternion
    return [rotations.rotate(quaternion, np.tile(axis, (len(quaternion), 1))) for axis in np.eye(3)[::2]]


def _turned(rotation: Array, vectors: Array) -> Array:
    turned: Array = np.einsum("nij,nj->ni", rotation, vectors)
    return turned


def _yaw(forward: Array) -> Array:
    yaw: Array = np.arctan2(forward[:, 1], forward[:, 0])
    return yaw


def leveling(gravity: Array) -> Array:
    """Rotations (n, 3, 3) from the base frame into the heading frame, of measured directions of gravity (n, 3)."""
    up = -gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    forward = np.array([1.0, 0.0, 0.0]) - up[:, :1] * up
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    return np.stack([forward, rotations.cross(up, forward), up], axis=1)


def waypoints(paths: Paths, now: Situation, ahead: tuple[float, float], heading: Array) -> Array:
    """The next points of the path from the object's centre in a frame with a heading (n,) [rad]: x, y, heading, height
    from the object's, of each; and the way left. (n, 9)."""
    columns = []
    for distance in ahead:
        way = now.covered + distance
        point = paths.point(now.path, way) - now.position[:, :2]
        columns += [turned(point, -heading), wrapped(paths.heading(now.path, way) - heading)[:, None]]
        columns += [(paths.height(now.path, way) - now.position[:, 2])[:, None]]
    return np.concatenate([*columns, now.left[:, None] / TIME], axis=1)


def felt_by_human(now: Situation, force: Array, action: Array, ahead: Array) -> dict[str, Array]:
    """What a human observes, in the frame of the object's yaw; `force` (n, 3) on the object in the frame of the start
    [N], `action` (n, 5): its last one, `ahead` (n, 9): its waypoints."""
    return {
        "handle": turned(now.handle - now.position, -now.yaw),
        "handle_velocity": turned(now.handle_velocity, -now.yaw),
        "object_yaw_rate": now.yaw_rate,
        "yaw_error": now.yaw_error,
        "lateral": now.lateral,
        "height_error": 10.0 * now.height_error,
        "tilt": now.tilt,
        "force": turned(force, -now.yaw) / FORCE,
        "waypoints": ahead,
        "action": action,
    }


def hidden(simulation: Simulation, moved: Motion, seconds_left: Array, acts: Array) -> dict[str, Array]:
    """What neither agent observes and the critic does;
    `acts`: whether the human of the actions plays, (n,)."""
    drawn = simulation.drawn
    behaviour = drawn["partner_behaviour"].astype(int)
    return {
        "acts": acts,
        "behaviour": np.eye(len(BEHAVIOURS))[behaviour] * ~acts[:, None],
        "drawn": np.stack([drawn[name] / unit for name, unit in DRAWN.items()], axis=1),
        "base_velocity": moved.base_velocity,
        "yaw_rate": moved.yaw_rate,
        "hand_force": moved.hand_force / FORCE,
        "external_force": moved.external_force / FORCE,
        "pelvis_height": moved.pelvis_height,
        "seconds_left": seconds_left / TIME,
    }
