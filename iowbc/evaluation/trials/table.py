"""The long table of `trials.parquet`: one row a trial, from which it can be played again."""

import json
from typing import Any

import numpy as np
import pandas as pd

from iowbc.arrays import Array
from iowbc.evaluation.trials.metrics import Measure, Met, trial_metrics
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.plan import Trial
from iowbc.recipe.evaluation.success import Success
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import GRAVITY, Robot
from iowbc.task.episodes import Episode

STAGNATION = "stagnation"


def measure_of(recipe: Recipe, robot: Robot) -> Measure:
    """How the trials of a recipe are measured."""
    task = recipe.task
    return Measure(
        control_frequency=task.control_frequency,
        gait=task.references.gait,
        commands=task.commands,
        foot_load=recipe.eval.foot_load,
        push_part=recipe.eval.success.push_force,
        efforts=dict(zip(robot.joints, robot.effort.tolist(), strict=True)),
    )


def met(recipe: Recipe, episode: Episode, outcome: Outcome) -> Met:
    """What a trial met."""
    kind = getattr(recipe.simulation.scenes, episode.scene).kind
    drawn = {name: float(outcome.drawn[name][0]) for name in ("object_mass", "ground_friction", "rolling_resistance")}
    return Met(
        held_weight=GRAVITY * drawn["object_mass"] if kind == "lift" else 0.0,
        ground_friction=drawn["ground_friction"],
        rolling_resistance=drawn["rolling_resistance"] if kind == "push" else np.inf,
        pull=episode.pull,
    )


def trial_row(recipe: Recipe, measure: Measure, trial: Trial, outcome: Outcome) -> dict[str, Any]:
    """One row of the long table: what was tried, how it ended, the metrics, everything drawn, and how to replay it."""
    episode, fixed = trial.episode, trial.episode.fixed
    if episode.script is None:
        raise ValueError(f"trial {trial.suite} {trial.case} has no command sequence to measure it by")
    metrics = trial_metrics(outcome.trace, episode.script, measure, met(recipe, episode, outcome))
    alive = survived(recipe.eval.success, outcome)
    return {
        "variant": recipe.eval.label,
        "policy": recipe.eval.policy,
        "kind": trial.kind,
        "suite": trial.suite,
        "case": trial.case,
        "scene": episode.scene,
        "mass": trial.mass,
        "impulse": trial.impulse,
        "trial": trial.number,
        "seed": episode.seed,
        "duration": episode.duration,
        "height": recipe.rg.height,
        "gait_period": 1.0 / measure.gait.frequency,
        "partner_share": fixed.get("partner_share", np.nan),
        "pull_frequency": np.nan if episode.pull is None else episode.pull.frequency,
        "rolling_resistance": fixed.get("object_ground_friction", np.nan),
        "survived": alive,
        "succeeded": alive and succeeded(recipe.eval.success, trial.kind, metrics),
        "carried": metrics["weight_in_hands"] >= recipe.eval.success.weight_in_hands,
        "kept": metrics["object_beside"] <= recipe.eval.success.object_beside,
        "end": outcome.ending,
        "seconds": outcome.seconds,
        **metrics,
        **{f"drawn_{name}": _plain(values) for name, values in outcome.drawn.items()},
        "episode": json.dumps(episode.as_json()),
    }


def survived(success: Success, outcome: Outcome) -> bool:
    """Whether a trial counts as survived; by recipe only where no hand ever let go."""
    slipped = success.slip_fails and bool(np.any(outcome.trace.slipped > 0))
    return outcome.survived and not slipped


def succeeded(success: Success, kind: str, metrics: dict[str, float]) -> bool:
    """Whether a trial that was survived is a success: transport of what the hands carry or do not lose, or in a
    push that is infeasible posture."""
    if kind == STAGNATION:
        return metrics["E_alpha"] <= success.posture_pitch and metrics["E_h"] <= success.posture_height
    return carried_along(success, metrics)


def carried_along(asked: Success | Acceptance, metrics: dict[str, float]) -> bool:
    """Whether robot and object cover enough of the way, with enough of the weight in the hands, and stay together."""
    shares = (
        (metrics["transport_robot"], asked.transport),
        (metrics["transport_object"], asked.transport),
        (metrics["weight_in_hands"], asked.weight_in_hands),
    )
    kept = not metrics["object_beside"] > asked.object_beside
    return kept and all(np.isnan(share) or share >= least for share, least in shares)


def replayed(row: "pd.Series[Any]") -> Episode:
    """The episode of a row of the long table, to be played again."""
    return Episode.from_json(json.loads(row["episode"]))


def _plain(values: Array) -> float | list[float]:
    return float(values[0]) if len(values) == 1 else [float(value) for value in values]
