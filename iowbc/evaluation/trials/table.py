"""The long table of `trials.parquet`: one row per trial, from which the trial can be replayed."""

import json
from typing import Any

import numpy as np
import pandas as pd

from iowbc.evaluation.trials.metrics import trial_metrics
from iowbc.evaluation.trials.plan import Trial
from iowbc.evaluation.trials.rollout import Outcome
from iowbc.recipe.evaluation.evaluation import Success
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.episodes import Episode


def trial_row(recipe: Recipe, robot: Robot, trial: Trial, outcome: Outcome) -> dict[str, Any]:
    """One row of the long table: trial, outcome, metrics, random draws, and the episode for a replay. Metrics are
    rounded to single precision, which halves the file."""
    episode, fixed = trial.episode, trial.episode.fixed
    measured = trial_metrics(recipe, robot, episode, outcome)
    metrics = {name: float(np.float32(value)) for name, value in measured.items()} | {"seconds": outcome.seconds}
    alive, drawn = outcome.survived, outcome.drawn
    hold = float(drawn["ground_friction"][0]) * float(outcome.trace.foot_load.sum(axis=1).mean())
    blocked = float(drawn["rolling_resistance"][0]) > hold  # the feet slip before a crate moves
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
        "split": recipe.eval.split,
        "seed": episode.seed,
        "duration": episode.duration,
        "height": recipe.rg.height,
        "gait_period": 1.0 / recipe.task.references.gait.frequency,
        "partner_share": fixed.get("partner_share", np.nan),
        "pull_frequency": np.nan if episode.pull is None else episode.pull.frequency,
        "pull_direction": "" if episode.pull is None else episode.pull.direction,
        "rolling_resistance": fixed.get("object_ground_friction", np.nan),
        "survived": alive,
        "succeeded": alive and succeeded(recipe.eval.success, trial.kind, metrics, blocked=blocked),
        "carried": metrics["weight_in_hands"] >= recipe.eval.success.weight_in_hands,
        "kept": metrics["object_beside"] <= recipe.eval.success.object_beside,
        "end": outcome.ending,
        **metrics,
        **{f"drawn_{name}": own.item() if len(own) == 1 else own.tolist() for name, own in drawn.items()},
        "episode": json.dumps(episode.as_json()),
    }


def succeeded(success: Success, kind: str, metrics: dict[str, float], *, blocked: bool = False) -> bool:
    """True if a survived trial is a success, see `transported`; in compliance trials also with bounded handle force.

    Infeasible pushes are judged by posture and pushing instead: in stagnation by the time of pushing with bounded foot
    slip, before a blocked crate (`blocked`) by a minimum push force with bounded hand force.
    """
    posture = metrics["E_alpha"] <= success.posture_pitch and metrics["E_h"] <= success.posture_height
    if kind == "stagnation":
        pushes = metrics["push_force_share"] >= success.push_time
        return posture and pushes and metrics["foot_slip"] <= success.foot_slide * metrics["seconds"]
    if kind == "compliance" and blocked:
        pushes = metrics["push_force"] >= success.least_push
        return posture and pushes and metrics["hand_force_p95"] <= success.hand_force
    if kind == "compliance":
        bounded = not metrics["handle_force_p95"] > success.handle_force
        return bounded and transported(success, metrics, success.compliance_transport)
    return transported(success, metrics)


def transported(asked: Success | Acceptance, metrics: dict[str, float], transport: float | None = None) -> bool:
    """True if robot and object cover enough of the path, with enough weight in the hands, and stay together. transport:
    sufficient fraction of the path, default that of `asked`."""
    least = asked.transport if transport is None else transport
    shares = (
        (metrics["transport_robot"], least),
        (metrics["transport_object"], least),
        (metrics["weight_in_hands"], asked.weight_in_hands),
    )
    kept = not metrics["object_beside"] > asked.object_beside
    return kept and all(np.isnan(share) or share >= least for share, least in shares)


def replayed(row: "pd.Series[Any]") -> Episode:
    """The episode of a row of the long table, for a replay."""
    return Episode.from_json(json.loads(row["episode"]))
