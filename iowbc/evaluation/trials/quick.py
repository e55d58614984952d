"""Small fixed evaluation for use during training, to compare policies."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.metrics import trial_row
from iowbc.evaluation.trials.plan import UNDISTURBED, Trial, planned_episode, script_for
from iowbc.evaluation.trials.rollout import play_in
from iowbc.learning.acting import Policy
from iowbc.recipe.teacher import Check
from iowbc.robot.description import load_robot
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

FIGURES = ("survived", "succeeded", "transport_robot", "weight_in_hands", *ERRORS, "upright")
"""Columns that are averaged."""
BY_LOAD = ("survived", "succeeded", *ERRORS)
"""Metrics that are also averaged per load."""


def quick_trials(world: Specification, scene: str, masses: Sequence[float], count: int, seed: int) -> list[Trial]:
    """`count` trials of a scene's commands at each mass [kg], without partner and disturbances. `seed`: of the first
    trial, without split offset, so that the trials belong to the development split."""
    scripts = [script_for(world.recipe, scene, seed + number) for number in range(count)]
    fixed = UNDISTURBED | {"partner_share": 0.0}
    return [
        Trial("quick", "quick", scene, mass, number, planned_episode(scene, script, mass, seed + number, fixed))
        for mass in masses
        for number, script in enumerate(scripts)
    ]


class QuickEvaluation:
    """Repeated evaluation of policies on the same trials; must be closed with `close`."""

    def __init__(self, world: Specification, trials: Sequence[Trial], check: Check, workers: int = 0) -> None:
        """`check`: see `figures`; `workers`: number of worker processes, which does not affect results; 0: none."""
        self.world, self.trials, self._check = world, tuple(trials), check
        self._robot = load_robot(world.robot)
        episodes = [trial.episode for trial in trials]
        self._environment = VectorEnv(world, num_envs=len(episodes), workers=workers, seed=0, episodes=episodes)

    def play(self, policy: Policy) -> dict[str, float]:
        """Means over all trials, see `figures`, and over those of each load: `push_30_kg/survived`, `…/E_v`."""
        outcomes = zip(self.trials, play_in(self._environment, policy), strict=True)
        rows = [
            trial_row(self.world.recipe, self._robot, trial, outcome)
            | {"upright": outcome.seconds / trial.episode.duration, "load": f"{trial.case}_{trial.mass:g}_kg"}
            for trial, outcome in outcomes
        ]
        found = figures(rows, self._check)
        for load in dict.fromkeys(row["load"] for row in rows):
            own = figures([row for row in rows if row["load"] == load], self._check)
            found |= {f"{load}/{name}": own[name] for name in BY_LOAD}
        return found

    def close(self) -> None:
        self._environment.close()


def figures(rows: Sequence[Mapping[str, Any]], check: Check) -> dict[str, float]:
    """Means over trials: survived, succeeded, transport, weight_in_hands, upright (fraction of the time), four errors
    up to the end of each trial, and `score` in [0, 1]: the fraction of the time upright times the mean over the four
    errors of 1 / (1 + error / scale), which is 1/2 at the scale (`check.scales`); if not survived also times
    `check.fall`."""
    columns = {name.removesuffix("_robot"): np.array([row[name] for row in rows], np.float64) for name in FIGURES}
    means = {name: float(np.nanmean(own)) if np.isfinite(own).any() else 0.0 for name, own in columns.items()}
    quality = [np.mean(1.0 / (1.0 + np.array([row[name] for name in ERRORS]) / check.scales)) for row in rows]
    lasted = [row["upright"] * (1.0 if row["survived"] else check.fall) for row in rows]
    score = np.mean([one * part for one, part in zip(quality, lasted, strict=True)])
    return means | {"score": float(score)}
