"""A small fixed evaluation that a training plays again and again, to tell its better policies from its worse."""

from collections.abc import Sequence
from types import TracebackType
from typing import Self

import numpy as np

from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.plan import UNDISTURBED, Condition, Trial, script_for
from iowbc.evaluation.trials.rollout import Acting, play_in
from iowbc.evaluation.trials.table import measure_of, trial_row
from iowbc.recipe.teacher import Check
from iowbc.robot.description import load_robot
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

FIGURES = {
    "survived": "survived",
    "succeeded": "succeeded",
    "transport_robot": "transport",
    "weight_in_hands": "weight_in_hands",
}
"""Columns of the long table that are told, and their names here."""
BY_LOAD = ("survived", "succeeded", *ERRORS)
"""Figures that are also told of each load."""


def quick_trials(world: Specification, scene: str, masses: Sequence[float], count: int, seed: int) -> list[Trial]:
    """`count` trials of a scene's commands at each mass [kg], without a partner and without disturbances.

    `seed`: of the first trial, as the recipe says it, which makes it one of the development split.
    """
    scripts = [script_for(world.recipe, scene, seed + number) for number in range(count)]
    conditions = [Condition(scene, script, UNDISTURBED | {"partner_share": 0.0}) for script in scripts]
    return [
        Trial("quick", "quick", scene, mass, number, condition.episode(mass, seed + number))
        for mass in masses
        for number, condition in enumerate(conditions)
    ]


class QuickEvaluation:
    """Plays the same trials with one policy after another. Use as a context manager, or `close` it."""

    def __init__(
        self, world: Specification, trials: Sequence[Trial], *, check: Check | None = None, workers: int = 0
    ) -> None:
        """`check`: see `figures`; `workers`: processes, on which no figure depends; 0 steps the trials in this one."""
        self._check = check or Check()
        self.world, self.trials, self.recipe = world, tuple(trials), world.recipe
        self._measure = measure_of(world.recipe, load_robot(world.robot))
        episodes = [trial.episode for trial in trials]
        self._environment = VectorEnv(world, num_envs=len(episodes), workers=workers, seed=0, episodes=episodes)

    @property
    def middle(self) -> Trial:
        """The one in the middle: with as many trials of each load, one of a middling load."""
        return self.trials[(len(self.trials) - 1) // 2]

    def play(self, policy: Acting) -> dict[str, float]:
        """Means over all trials, see `figures`, and over those of each load: `push_30_kg/survived`, `…/E_v`."""
        outcomes = play_in(self._environment, policy)
        rows = [self._row(trial, outcome) for trial, outcome in zip(self.trials, outcomes, strict=True)]
        loads: dict[str, list[dict[str, float]]] = {}
        for trial, row in zip(self.trials, rows, strict=True):
            loads.setdefault(f"{trial.case}_{trial.mass:g}_kg", []).append(row)
        told = {load: figures(own, self._check) for load, own in loads.items()}
        return figures(rows, self._check) | {f"{load}/{name}": told[load][name] for load in told for name in BY_LOAD}

    def _row(self, trial: Trial, outcome: Outcome) -> dict[str, float]:
        row = trial_row(self.recipe, self._measure, trial, outcome)
        return {name: float(row[name]) for name in (*FIGURES, *ERRORS)} | {
            "upright": outcome.seconds / trial.episode.duration
        }

    def close(self) -> None:
        """Ends the environments."""
        self._environment.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def figures(rows: Sequence[dict[str, float]], check: Check) -> dict[str, float]:
    """Means over trials: survived, succeeded, transport, weight_in_hands, upright (part of the time), four errors up
    to the end of each trial, and `score`.

    The score of a trial, in [0, 1], is the part of the time that it stayed upright times the mean over the four errors
    of 1 / (1 + error / scale): 1 without any error, 1/2 at its scale (`check.scales`); times `check.fall` where it is
    not survived.
    """
    means = {
        told: float(np.nanmean(values)) if np.isfinite(values).any() else 0.0
        for name, told in [*FIGURES.items(), *((error, error) for error in ERRORS), ("upright", "upright")]
        for values in [np.array([row[name] for row in rows])]
    }
    scaled = [np.array([row[name] for name in ERRORS]) / check.scales for row in rows]
    quality = [np.mean(1.0 / (1.0 + errors)) for errors in scaled]
    lasted = [row["upright"] * (1.0 if row["survived"] else check.fall) for row in rows]
    score = np.mean([one * part for one, part in zip(quality, lasted, strict=True)])
    return means | {"score": float(score)}
