"""Outcomes of the games: endings and the shared reward of a decision, and metrics of an episode, which are sums and
extremes over its control steps, read at its end."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.recipe.skill.skill import Skill
from iowbc.robot.rotations import TINY
from iowbc.skill.situation import GameState

HIGH = 90.0
"""Percentile of the partner's force."""
FIGURES = (
    *("success", "time", "path_error", "path_error_max", "yaw_error", "height_error", "tilt", "internal_force"),
    *("partner_force_mean", "partner_force_p90", "partner_work", "load_share", "fallen", "dropped", "touched"),
    *("strayed", "diverged", "time_out", "covered", "reward", "known", "mass", "share"),
    *("task", "partner", "environment", "episode"),
)
"""Metrics of an episode in seconds, metres, radians, newtons and joules. Tilt is the largest; internal force and
absolute yaw and height errors are means; `touched` is time in a wall [s]; task and partner are numbers."""


@dataclass(frozen=True)
class GameEnding:
    """Causes of endings in a decision, each (n,)."""

    success: Mask
    fallen: Mask
    dropped: Mask
    strayed: Mask
    diverged: Mask
    time_out: Mask

    @property
    def failed(self) -> Mask:
        """Ended with a penalty; divergence of the simulation has none."""
        return self.fallen | self.dropped | self.strayed

    @property
    def terminated(self) -> Mask:
        """Ended other than by the time limit."""
        return self.success | self.failed | self.diverged


def ending(skill: Skill, now: GameState, *, held: Mask, happened: Mask, late: Mask) -> GameEnding:
    """Endings. `held`: object in the hands; `happened` (3, n): falls, drops, divergence; `late`: past the limit."""
    finish = skill.finish
    fallen, dropped, diverged = happened
    reached = (now.left < finish.distance) & (np.abs(now.lateral) < finish.lateral)
    reached &= (np.abs(now.yaw_error) < finish.yaw) & (~held | (np.abs(now.height_error) < finish.height))
    sound = ~(fallen | dropped | diverged)
    strayed = (np.abs(now.lateral) > finish.stray) & sound
    success = reached & sound & ~strayed
    over = ~sound | strayed | success
    fell, lost = fallen & ~diverged, dropped & ~(fallen | diverged)
    return GameEnding(success, fell, lost, strayed, diverged, late & ~over)


def potential(skill: Skill, now: GameState, held: Mask) -> Array:
    """Potential Φ = progress · s - path |e| - yaw |ψ| - height |z| with the arc length s, (n,)."""
    weights = skill.reward
    value: Array = weights.progress * now.covered - weights.path * np.abs(now.lateral)
    value -= weights.yaw * np.abs(now.yaw_error) + weights.height * held * np.abs(now.height_error)
    return value


def reward(skill: Skill, gained: Array, end: GameEnding, costs: Array, jerk: Array, touched: Mask) -> Array:
    """Shared reward of a decision, (n,). `gained`: change of the potential; `costs` (3, n): integrals of internal force
    [N·s], of the human's absolute power [J] and of the object's tilt [rad·s]; `jerk`: mean squared change of the
    robot's action."""
    weights, seconds = skill.reward, 1.0 / skill.frequency
    value: Array = gained + weights.success * end.success - weights.failure * end.failed
    value -= weights.internal_force * costs[0] + weights.partner_work * costs[1] + weights.tilt * costs[2]
    value -= weights.jerk * jerk + seconds * (weights.time + weights.touch * touched)
    return np.where(end.diverged, 0.0, value)


class EpisodeFigures:
    """Running metrics of n games."""

    def __init__(self, n: int, longest: int) -> None:
        """`longest`: control steps of the longest episode."""
        self._force = np.zeros((n, longest), np.float32)
        self._steps = np.zeros(n, np.int64)
        self._sum, self._most = np.zeros((n, 7)), np.zeros((n, 2))

    def start(self, which: Indices) -> None:
        """Resets some games, (k,)."""
        for values in (self._steps, self._sum, self._most):
            values[which] = 0

    def add(self, now: GameState, internal: Array, partner: Array, power: Array, loads: Array, period: float) -> None:
        """Adds a control step: internal force (n,) [N], the partner's horizontal force (n, 2) [N], its absolute power
        beyond its share (n,) [W], and the loads on the robot and on both, (n, 2) [N]."""
        rows = np.arange(len(internal))
        self._force[rows, self._steps.clip(None, self._force.shape[1] - 1)] = np.linalg.norm(partner, axis=1)
        self._steps += 1
        sizes = [now.lateral**2, np.abs(now.yaw_error), np.abs(now.height_error), internal, power * period, *loads.T]
        self._sum += np.stack(sizes, axis=1)
        np.maximum(self._most, np.stack([np.abs(now.lateral), now.tilt], axis=1), out=self._most)

    def read(self, which: Indices, period: float) -> dict[str, Array]:
        """Metrics of some games, (k,), so far."""
        steps = np.maximum(self._steps[which], 1)
        square, yaw, height, internal, work, robot, both = self._sum[which].T
        forces = [self._force[row, :count] for row, count in zip(which, steps, strict=True)]
        return {
            "time": steps * period,
            "path_error": np.sqrt(square / steps),
            "path_error_max": self._most[which, 0],
            "yaw_error": yaw / steps,
            "height_error": height / steps,
            "tilt": self._most[which, 1],
            "internal_force": internal / steps,
            "partner_force_mean": np.array([force.mean() for force in forces]),
            "partner_force_p90": np.array([np.percentile(force, HIGH) for force in forces]),
            "partner_work": work,
            "load_share": np.where(np.abs(both) > TINY, robot / np.where(np.abs(both) > TINY, both, 1.0), np.nan),
        }


def internal_force(robot: Array, partner: Array) -> Array:
    """The part of two horizontal forces (n, 2) that cancels, ½ (|F_r| + |F_p| - |F_r + F_p|), (n,) [N]."""
    sizes = [np.linalg.norm(force, axis=1) for force in (robot, partner, robot + partner)]
    return 0.5 * (sizes[0] + sizes[1] - sizes[2])
