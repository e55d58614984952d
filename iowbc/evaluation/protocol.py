"""The whole evaluation: every sweep and heavy case, one row a trial, resumable batch by batch."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from iowbc.evaluation.metrics import trial_metrics
from iowbc.evaluation.rollout import Acting, Played, play_episodes
from iowbc.evaluation.trials import Trial, heavier_mass, heavy_trials, sweep_trials
from iowbc.recipe.evaluation import Success
from iowbc.recipe.recipe import Recipe
from iowbc.task.episode import Episode


class Protocol:
    """Plays the trials of a recipe's `eval` section; finished batches are kept in `work` and not played again."""

    def __init__(
        self,
        recipe: Recipe,
        robot: Path,
        rg: Path | None,
        policy: Acting,
        *,
        work: Path,
        workers: int,
        interrupted: Callable[[], bool] = lambda: False,
        progress: Callable[[int, int, str], None] = lambda done, total, note: None,
    ) -> None:
        """`progress` is told trials done, trials known of, and the batch that is played."""
        self.recipe, self.robot, self.rg, self.policy = recipe, robot, rg, policy
        self.work, self.workers = work, workers
        self.interrupted, self.progress = interrupted, progress
        self.done, self.total = 0, 0

    def run(self) -> pd.DataFrame:
        """All trials, one row each: the table of `trials.parquet`. Raises Stopped when interrupted."""
        evaluation, commands = self.recipe.eval, self.recipe.task.commands
        sweeps = {"lifting": evaluation.lifting, "pushing": evaluation.pushing}
        heavy = heavy_trials(evaluation, commands)
        self.total = len(heavy) + sum(len(s.masses) * evaluation.trials for s in sweeps.values() if s is not None)
        parts = []
        for suite, sweep in sweeps.items():
            if sweep is None:
                continue
            parts.append(self._batch(suite, sweep_trials(evaluation, commands, suite, sweep, sweep.masses)))
            heaviest = sweep.masses[-1]
            while _any_survivor(parts[-1], heaviest) and (following := heavier_mass(sweep, heaviest)) is not None:
                heaviest = following
                trials = sweep_trials(evaluation, commands, suite, sweep, [heaviest])
                self.total += len(trials)
                parts.append(self._batch(f"{suite}-{heaviest:g}", trials))
        if heavy:
            parts.append(self._batch("heavy", heavy))
        return pd.concat(parts, ignore_index=True)

    def _batch(self, name: str, trials: Sequence[Trial]) -> pd.DataFrame:
        path = self.work / f"trials-{name}.parquet"
        if not path.is_file():
            played = play_episodes(
                self.recipe,
                self.robot,
                self.rg,
                [trial.episode for trial in trials],
                self.policy,
                workers=self.workers,
                interrupted=self.interrupted,
                progress=lambda seconds: self.progress(self.done, self.total, f"{name}, {seconds:.0f} s"),
            )
            rows = [trial_row(self.recipe, t, p) for t, p in zip(trials, played, strict=True)]
            table = pd.DataFrame(rows).assign(batch_size=len(rows), batch_row=range(len(rows)))
            unfinished = path.with_suffix(".part")
            table.to_parquet(unfinished, index=False)
            unfinished.rename(path)
        self.done += len(trials)
        self.progress(self.done, self.total, name)
        return pd.read_parquet(path)


def trial_row(recipe: Recipe, trial: Trial, played: Played) -> dict[str, Any]:
    """One row of the long table: what was tried, how it ended, the metrics, everything drawn, and how to replay it."""
    gait_steps = round(recipe.task.control_frequency / recipe.task.references.gait.frequency)
    return {
        "variant": recipe.eval.label,
        "policy": recipe.eval.policy,
        "suite": trial.suite,
        "case": trial.case,
        "scene": trial.episode.scene,
        "mass": trial.mass,
        "trial": trial.number,
        "seed": trial.episode.seed,
        "duration": trial.episode.duration,
        "survived": survived(recipe.eval.success, played),
        "end": ending(played),
        "seconds": played.seconds,
        **trial_metrics(played.trace, gait_steps),
        **{f"drawn_{name}": _plain(values) for name, values in played.drawn.items()},
        "episode": json.dumps(trial.episode.as_json()),
    }


def survived(success: Success, played: Played) -> bool:
    """Whether a trial counts as survived; by recipe only where no hand ever let go."""
    slipped = success.slip_fails and bool(np.any(played.trace.slipped > 0))
    return played.survived and not slipped


def ending(played: Played) -> str:
    """How a trial ended; "diverged" where the simulation broke off without a fall or a drop."""
    if played.fallen:
        return "fell"
    if played.dropped:
        return "dropped"
    return "finished" if played.finished else "diverged"


def replayed(row: "pd.Series[Any]") -> Episode:
    """The episode of a row of the long table, to be played again."""
    return Episode.from_json(json.loads(row["episode"]))


class InBatch:
    """A policy for one environment that computes in the shape of the batch in which a trial was played, at its place.

    Matrix products round differently for other shapes; with this, a trial that is played again is the same bit for bit.
    """

    def __init__(self, policy: Acting, row: "pd.Series[Any]") -> None:
        """`row`: the trial's row of the long table."""
        self.policy, self.size, self.place = policy, int(row["batch_size"]), int(row["batch_row"])

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.policy.reset(np.full(self.size, which[0]))

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        rows = (
            np.zeros((self.size, observation.shape[1]), np.float32),
            np.zeros((self.size, privileged.shape[1]), np.float32),
        )
        rows[0][self.place], rows[1][self.place] = observation[0], privileged[0]
        return self.policy.act(*rows)[self.place : self.place + 1]


def _plain(values: np.ndarray[Any, np.dtype[np.float64]]) -> float | list[float]:
    return float(values[0]) if len(values) == 1 else [float(value) for value in values]


def _any_survivor(table: pd.DataFrame, mass: float) -> bool:
    return bool(table.loc[table["mass"] == mass, "survived"].any())
