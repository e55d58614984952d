"""Endings and the shared reward of the games."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.skill.skill import Skill
from iowbc.skill.situation import GameState


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
