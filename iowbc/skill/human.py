"""Intentions of simulated humans, by script, by action or by a person's hand."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.skill.skill import Skill
from iowbc.robot.rotations import turned, wrapped
from iowbc.skill.object_motion import ObjectMotion
from iowbc.skill.situation import GameState


class Human:
    """Intentions of n humans: velocity of the handle (start frame), yaw rate, and height of the handle."""

    def __init__(self, skill: Skill, n: int, period: float) -> None:
        """`period`: control period [s]."""
        self._settings, self._pursuit, self._period = skill.human, skill.pursuit, period
        self._velocity, self._height = np.zeros((n, 4)), np.zeros((n, 2))
        """Velocity and yaw rate; height integrated from the velocity, and height offset."""
        self._offset = np.zeros(n)

    def start(self, which: Array) -> None:
        """Resets some humans, (k,)."""
        self._velocity[which], self._height[which], self._offset[which] = 0.0, 0.0, 0.0

    def of_action(self, action: Array, now: GameState) -> Array:
        """Intentions that actions add to the script's, (n, 5): velocity [m/s], yaw rate [rad/s], height offset [m].
        `action` (n, 5) in [-1, 1]: handle's velocity in the frame of the object's yaw, height offset, yaw rate."""
        s = self._settings
        scaled = action * np.array([s.velocity, s.velocity, s.vertical_velocity, s.height, s.yaw_rate])
        return np.concatenate([turned(scaled[:, :3], now.yaw), scaled[:, 4:], scaled[:, 3:4]], axis=1)

    def of_script(self, wanted: ObjectMotion, now: GameState) -> Array:
        """Intentions (n, 5) for the desired motion of the object; the handle circles its centre as it turns."""
        rate = wanted.yaw_rate + self._pursuit.yaw * wrapped(wanted.heading - now.yaw)
        arm = now.handle - now.position
        rise = (wanted.height - now.position[:, 2]) * self._pursuit.vertical
        limit = self._settings.vertical_velocity
        columns = [wanted.velocity[:, 0] - rate * arm[:, 1], wanted.velocity[:, 1] + rate * arm[:, 0]]
        return np.stack([*columns, rise.clip(-limit, limit), rate, np.zeros(len(rate))], axis=1)

    def intend(self, intentions: Array) -> None:
        """Sets intentions (n, 5) until the next decision."""
        self._velocity, self._offset = intentions[:, :4], intentions[:, 4]

    def reach(self, which: Mask, away: Array, now: GameState) -> None:
        """Moves the springs of some humans, (n,), towards hands at the offset `away` (n, 3) [m] (start frame), at most
        as fast as the human agent. The object's yaw is left to the robot."""
        s = self._settings
        velocity, fastest = away / s.hand_time, self._pursuit.speed + s.velocity
        velocity[:, :2] *= fastest / np.linalg.norm(velocity[:, :2], axis=1).clip(fastest)[:, None]
        velocity[:, 2] = velocity[:, 2].clip(-s.vertical_velocity, s.vertical_velocity)
        self._velocity[which] = np.column_stack([velocity, now.yaw_rate])[which]
        self._offset[which] = 0.0

    def advance(self) -> Array:
        """Input of the simulated partner for the next control step, (n, 4): see `Partner.steered`."""
        step = self._settings.vertical_velocity * self._period
        self._height[:, 0] += self._velocity[:, 2] * self._period
        self._height[:, 1] += (self._offset - self._height[:, 1]).clip(-step, step)
        return np.stack([*self._velocity[:, [0, 1, 3]].T, self._height.sum(axis=1)], axis=1)
