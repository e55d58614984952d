"""Metrics of a trial from its signals, its success, and its row of `trials.parquet`, from which it can be replayed."""

import json
from typing import Any

import numpy as np
import pandas as pd

from iowbc.arrays import Array
from iowbc.control.gait import wants_to_move
from iowbc.evaluation.trials import errors
from iowbc.evaluation.trials.feet import foot_metrics, ground_metrics
from iowbc.evaluation.trials.interaction import impedance_metrics, interaction_metrics, load_metrics, push_metrics
from iowbc.evaluation.trials.plan import Trial
from iowbc.evaluation.trials.rollout import Outcome
from iowbc.recipe.evaluation.evaluation import Success
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import GRAVITY, Robot
from iowbc.sim.drives import drawn_effort
from iowbc.task.episodes import Episode
from iowbc.task.record.signals import Trace


def trial_metrics(recipe: Recipe, robot: Robot, episode: Episode, outcome: Outcome) -> dict[str, float]:
    """All metrics of a trial.

    The paper's errors are relative to the original command: over the whole trial (`E_v`), while stepping is commanded
    (`E_v_moving`) and, from the script alone, for a robot that stands still (`still_E_v`, `still_E_v_moving`).
    `E_v_clamped` is relative to the command after feasibility clamping. `E_v_raw` is without averaging,
    `E_v_raw_moving` the same while stepping is commanded. `transport_robot`, `_object`: fractions of the commanded
    path, of length `commanded_distance`, that they cover; `object_beside`: see `beside` [m]. Raises ValueError for an
    episode without a command sequence or without a single step.
    """
    task, asked, script, trace = recipe.task, recipe.eval, episode.script, outcome.trace
    if script is None or len(trace) == 0:
        raise ValueError("a trial without a command sequence or without a single step has no metrics")
    gait, window = task.references.gait, round(task.control_frequency / task.references.gait.frequency)
    kind = getattr(recipe.simulation.scenes, episode.scene).kind
    mass, friction, rolling, share = (
        float(outcome.drawn[name][0])
        for name in ("object_mass", "ground_friction", "rolling_resistance", "partner_share")
    )
    limits = drawn_effort(robot, *(outcome.drawn[name][None] for name in ("motor_strength", "linkage_effort")))[0]
    held_weight = GRAVITY * mass if kind == "lift" else 0.0
    judged = held_weight * (1.0 - share) > asked.success.least_weight
    resistance = rolling if kind == "push" else np.inf
    whole = script.at(trace.dt * np.arange(round(script.duration / trace.dt)))
    given = script.at(trace.dt * np.arange(len(trace)))
    moving = wants_to_move(given, gait)
    deviations = errors.deviations_from_given(trace, given, window)
    still = errors.deviations_standing_still(whole, task.commands, trace.dt)
    raw = errors.velocity_deviation(trace.system_velocity, given, 1)
    directions, length = errors.commanded_path(whole, errors.start_heading(trace), trace.dt)
    path = errors.moving_average(trace.base_position[:, :2], window)
    walked = float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    object_position = trace.object_position if np.any(trace.object_position) else np.full((len(trace), 3), np.nan)
    still_errors = still.means() | still.means("_moving", wants_to_move(whole, gait))
    return {
        **deviations.means(),
        **deviations.means("_moving", moving),
        **errors.deviations_from_clamped(trace, window).means("_clamped"),
        **{f"still_{name}": value for name, value in still_errors.items()},
        "E_v_raw": float(np.mean(raw)),
        "E_v_raw_moving": float(np.mean(raw[moving])) if moving.any() else np.nan,
        "commanded_distance": length,
        "transport_robot": errors.covered(trace.base_position, directions, length),
        "transport_object": errors.covered(object_position, directions, length),
        "object_beside": errors.beside(trace.base_position, trace.heading, object_position, moving),
        "distance": walked,
        **foot_metrics(trace, asked.foot_load, walked),
        **ground_metrics(trace, asked.foot_load, friction),
        **load_metrics(trace, held_weight, judged),
        **interaction_metrics(trace, window),
        **push_metrics(trace, directions, window, friction, resistance, asked.success.push_force),
        **impedance_metrics(trace, episode.pull),
        **effort_metrics(trace, robot, limits),
    }


def effort_metrics(trace: Trace, robot: Robot, limits: Array) -> dict[str, float]:
    """Effort in the trial: torques, energy, forces at hands and partner, jerk of torso and object, and the root mean
    square of the action's second difference over time and support joints [rad].

    limits: torque limits drawn for the trial's motors and linkages, (joints,) [N·m].

    `torque_rms/<joint>`: RMS torque of a joint, or of both joints of its linkage |τ_a| + |τ_b|, as a fraction of its
    limit; `torque_rms`: the largest of these.
    """
    grips = np.linalg.norm(trace.grip_force.reshape(-1, 2, 3), axis=2)
    peak, saturated = np.abs(trace.joint_torque).max(axis=0), trace.joint_saturation.mean(axis=0)
    driven, pairs = np.abs(trace.joint_torque), robot.linkages
    driven[:, pairs] = driven[:, pairs].sum(axis=2, keepdims=True)
    effort = np.sqrt(np.mean(np.square(driven), axis=0)) / limits
    return {
        "saturation": float(np.mean(trace.saturation)),
        "saturation_peak": float(np.max(trace.saturation)),
        "slip_share": float(np.mean(trace.slipped > 0)),
        "partner_force_peak": float(np.max(np.linalg.norm(trace.partner_force, axis=1))),
        "grip_force_peak": float(np.max(grips)),
        "link_object_force": float(np.mean(trace.link_object_force)),
        "energy": float(np.sum(trace.power) * trace.dt),
        "torso_jerk": jerk(trace.torso_position, trace.dt),
        "object_jerk": jerk(trace.object_position, trace.dt) if np.any(trace.object_position) else np.nan,
        "action_second_difference": second_difference(trace.action),
        "torque_rms": float(np.max(effort)),
        **{
            f"{name}/{joint}": float(value)
            for name, values in (("peak_torque", peak), ("saturated", saturated), ("torque_rms", effort))
            for joint, value in zip(robot.joints, values, strict=True)
        },
    }


def second_difference(values: Array) -> float:
    """Root mean square of a_{t+1} - 2 a_t + a_{t-1} over (T, k), in their unit; NaN for fewer than three rows."""
    return float(np.sqrt(np.mean(np.square(np.diff(values, 2, axis=0))))) if len(values) > 2 else np.nan


def jerk(position: Array, dt: float) -> float:
    """Root mean square jerk of a path (T, 3), by third differences [m/s³]; NaN for fewer than four rows."""
    if len(position) < 4:
        return np.nan
    return float(np.sqrt(np.mean(np.sum(np.square(np.diff(position, 3, axis=0) / dt**3), axis=1))))


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
