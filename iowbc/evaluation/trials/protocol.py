"""The whole evaluation: every sweep and heavy case, one row a trial, resumable batch by batch."""

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
import pandas as pd

from iowbc.evaluation.trials.batch_policy import PolicyInBatch
from iowbc.evaluation.trials.plan import Trial, heavier_mass, heavy_trials, sweep_trials
from iowbc.evaluation.trials.rollout import Acting, play_episodes
from iowbc.evaluation.trials.table import trial_row
from iowbc.files import replacing
from iowbc.recipe.recipe import Recipe


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

            outcomes = play_episodes(
                self.recipe,
                self.robot,
                self.rg,
                [trial.episode for trial in trials],
                PolicyInBatch(self.policy, size, places),
                workers=self.workers,
                interrupted=self.interrupted,
                progress=progress,
            )
            rows = [trial_row(self.recipe, trial, outcome) for trial, outcome in zip(trials, outcomes, strict=True)]
            table = pd.DataFrame(rows).assign(batch_size=size, batch_row=places)
            with replacing(path) as fresh:
                table.to_parquet(fresh, index=False)
        self.done += len(trials)
        self.progress(self.done, self.total, name)
        return pd.read_parquet(path)


def _any_survivor(table: pd.DataFrame, mass: float) -> bool:
    return bool(table.loc[table["mass"] == mass, "survived"].any())
