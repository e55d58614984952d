"""The whole evaluation: every sweep and heavy case, one row a trial, resumable batch by batch."""

import json
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from iowbc.evaluation.trials.metrics import trial_metrics
from iowbc.evaluation.trials.plan import Trial, heavier_mass, heavy_trials, sweep_trials
from iowbc.evaluation.trials.rollout import Acting, Played, play_episodes
from iowbc.files import replacing
from iowbc.recipe.evaluation import Success
from iowbc.recipe.recipe import Recipe
from iowbc.task.episodes import Episode


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
        progress: Callable[[float, float, str], None] = lambda done, total, note: None,
    ) -> None:
        """`progress` is told trials done, trials known of, and the batch that is played."""
        self.recipe, self.robot, self.rg, self.policy = recipe, robot, rg, policy
        self.work, self.workers = work, workers
        self.interrupted, self.progress = interrupted, progress
        self.done, self.total = 0, 0

    def run(self) -> pd.DataFrame:
        """All trials, one row each: the table of `trials.parquet`. Raises Interrupted when interrupted."""
        evaluation, commands = self.recipe.eval, self.recipe.task.commands
        sweeps = {"lifting": evaluation.lifting, "pushing": evaluation.pushing}
        heavy = heavy_trials(evaluation, commands)
        self.total = len(heavy) + sum(len(s.masses) * evaluation.trials for s in sweeps.values() if s is not None)
        tables: list[pd.DataFrame] = []
        for suite, sweep in sweeps.items():
            if sweep is None:
                continue
            tables.extend(self._batches(sweep_trials(evaluation, commands, suite, sweep, sweep.masses)))
            heaviest = sweep.masses[-1]
            while _any_survivor(tables[-1], heaviest) and (following := heavier_mass(sweep, heaviest)) is not None:
                heaviest = following
                trials = sweep_trials(evaluation, commands, suite, sweep, [heaviest])
                self.total += len(trials)
                tables.extend(self._batches(trials))
        tables.extend(self._batches(heavy))
        return pd.concat(tables, ignore_index=True)

    def _batches(self, trials: Sequence[Trial]) -> Iterator[pd.DataFrame]:
        """The tables of some trials, a batch for each case and mass; the policy computes in the shape of them all."""
        begin = 0
        for (case, mass), group in groupby(trials, lambda trial: (trial.case, trial.mass)):
            batch = list(group)
            name = case if batch[0].suite == "heavy" else f"{case}-{mass:g}"
            yield self._batch(name, batch, begin, len(trials))
            begin += len(batch)

    def _batch(self, name: str, trials: Sequence[Trial], begin: int, size: int) -> pd.DataFrame:
        """Rows `begin` and on of `size`."""
        path = self.work / f"trials-{name}.parquet"
        places = np.arange(begin, begin + len(trials))
        if not path.is_file():
            longest = max(trial.episode.duration for trial in trials)

            def progress(seconds: float) -> None:
                reached = self.done + len(trials) * min(seconds / longest, 1.0)
                self.progress(reached, self.total, f"{name}, {seconds:.0f} s")

            played = play_episodes(
                self.recipe,
                self.robot,
                self.rg,
                [trial.episode for trial in trials],
                Placed(self.policy, size, places),
                workers=self.workers,
                interrupted=self.interrupted,
                progress=progress,
            )
            rows = [trial_row(self.recipe, t, p) for t, p in zip(trials, played, strict=True)]
            table = pd.DataFrame(rows).assign(batch_size=size, batch_row=places)
            with replacing(path) as fresh:
                table.to_parquet(fresh, index=False)
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


class Placed:
    """A policy for some environments that computes in the shape of a larger batch, with them at given places.

    Matrix products round differently for other shapes; with this, a trial is the same bit for bit whichever trials of
    its sweep it is played with.
    """

    def __init__(self, policy: Acting, size: int, places: NDArray[np.int64]) -> None:
        """`places` (n,): the environments' rows in the batch of `size`."""
        self.policy, self.size, self.places = policy, size, places

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.policy.reset(self._spread(which))

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        return self.policy.act(self._spread(observation), self._spread(privileged))[self.places]

    def _spread(self, rows: NDArray[Any]) -> NDArray[Any]:
        batch = np.zeros((self.size, *rows.shape[1:]), rows.dtype)
        batch[self.places] = rows
        return batch


def in_batch(policy: Acting, row: "pd.Series[Any]") -> Placed:
    """The policy as it acted in the trial of a row of the long table, for that trial alone."""
    return Placed(policy, int(row["batch_size"]), np.array([int(row["batch_row"])]))


def _plain(values: np.ndarray[Any, np.dtype[np.float64]]) -> float | list[float]:
    return float(values[0]) if len(values) == 1 else [float(value) for value in values]


def _any_survivor(table: pd.DataFrame, mass: float) -> bool:
    return bool(table.loc[table["mass"] == mass, "survived"].any())
