"""Observations of robot, human and centralised critic: named parts, concatenated in order."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.skill_observation import FORCE, SENSED, TIME
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.skill.skill import Skill
from iowbc.robot.rotations import turned, wrapped
from iowbc.sim.simulation import Simulation
from iowbc.skill.situation import GameState, Paths
from iowbc.task.motion import Motion

DRAWN = {"partner_stiffness": 300.0, "partner_damping": 50.0, "partner_delay": 0.3, "partner_noise": 8.0}
DRAWN |= {"partner_pace": 1.0, "partner_share": 1.0, "object_mass": 20.0, "object_ground_friction": 0.1}
"""Simulation quantities that the critic observes, with their scales."""
FELT = 28
"""Size of the human's observation."""
HIDDEN = 13 + len(BEHAVIOURS) + len(DRAWN)


def sizes(skill: Skill) -> tuple[tuple[str, int], ...]:
    """Sizes of the observations of "robot" and "human", and of the critic's "state": both, and what they do not see."""
    robot = SENSED + 6 * skill.robot.history
    return ("robot", robot), ("human", FELT), ("state", robot + FELT + HIDDEN)


def waypoints(paths: Paths, now: GameState, ahead: tuple[float, float], heading: Array) -> Array:
    """Next points of the path relative to the object's centre, in a frame with a heading (n,) [rad]: x, y, heading and
    relative height of each, then the remaining length. (n, 9)."""
    columns = []
    for distance in ahead:
        way = now.covered + distance
        point = paths.point(now.path, way) - now.position[:, :2]
        columns += [turned(point, -heading), wrapped(paths.heading(now.path, way) - heading)[:, None]]
        columns += [(paths.height(now.path, way) - now.position[:, 2])[:, None]]
    return np.concatenate([*columns, now.left[:, None] / TIME], axis=1)


def human_observation(now: GameState, force: Array, action: Array, ahead: Array) -> dict[str, Array]:
    """Human observation in the frame of the object's yaw. `force` (n, 3): on the object, start frame [N]; `action` (n,
    5): its last one; `ahead` (n, 9): its waypoints."""
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
    """Critic inputs that neither agent observes; `acts`: true where the human agent acts, (n,)."""
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
