"""The long table of `trials.parquet`: one row a trial, from which it can be played again."""

import json
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from iowbc.evaluation.trials.metrics import trial_metrics
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.plan import Trial
from iowbc.recipe.evaluation import Success
from iowbc.recipe.recipe import Recipe
from iowbc.task.episodes import Episode


def trial_row(recipe: Recipe, trial: Trial, outcome: Outcome) -> dict[str, Any]:
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
        "survived": survived(recipe.eval.success, outcome),
        "end": outcome.ending,
        "seconds": outcome.seconds,
        **trial_metrics(outcome.trace, gait_steps),
        **{f"drawn_{name}": _plain(values) for name, values in outcome.drawn.items()},
        "episode": json.dumps(trial.episode.as_json()),
    }


def survived(success: Success, outcome: Outcome) -> bool:
    """Whether a trial counts as survived; by recipe only where no hand ever let go."""
    slipped = success.slip_fails and bool(np.any(outcome.trace.slipped > 0))
    return outcome.survived and not slipped


def replayed(row: "pd.Series[Any]") -> Episode:
    """The episode of a row of the long table, to be played again."""
    return Episode.from_json(json.loads(row["episode"]))


def _plain(values: NDArray[np.float64]) -> float | list[float]:
    return float(values[0]) if len(values) == 1 else [float(value) for value in values]
