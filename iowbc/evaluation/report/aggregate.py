"""Summary of the long table of trials: one row per variant, suite, case, mass and impulse."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import VARIANTS
from iowbc.evaluation.report.statistics import design_effect, mean_half_width, wilson_interval
from iowbc.evaluation.trials.errors import ERRORS, error_norm

ALL_ERRORS = tuple(f"{name}{part}" for part in ("", "_moving", "_clamped") for name in ERRORS)
"""The errors over the whole trial, while stepping is commanded, against clamped commands."""
STILL = tuple(f"still_{name}{part}" for part in ("", "_moving") for name in ERRORS)
"""The errors of a robot that stands still, from the script alone."""
OVER_ALL_TRIALS = (
    *("transport_robot", "transport_object", "hand_force_mean", "hand_force_p95", "hand_force_peak"),
    *("handle_force_mean", "handle_force_p95", "handle_force_peak", "partner_work"),
)
"""Metrics averaged over all trials, since a robot pulls before it falls; all others over surviving trials."""
SETTINGS = (
    *("commanded_distance", "partner_share", "rolling_resistance", "pull_frequency", "pull_direction"),
    *("height", "gait_period"),
)
"""Columns with the same value in all trials of a row, but for the length of drawn commands: that of the first trial."""
TORQUE = "torque_rms"
"""RMS torque as a fraction of the limit drawn for the trial: of the worst joint and, with a slash and a name, of each
joint."""
TRAINING = "training_seed"
"""Column that identifies the training of a variant; if absent, there is only one."""
WORLD = "trial"
"""Column that identifies the world. Trials of one number have the same random draws and commands at every mass, in
every suite and with every training; intervals treat them as one cluster."""
GROUP = ["variant", "kind", "suite", "case", "mass", "impulse"]


def case_names(rows: pd.DataFrame) -> "pd.Series[str]":
    """The case of each row, after its suite where several suites have a case of that name."""
    suites = rows.groupby("case")["suite"].transform("nunique")
    return rows["case"].where(suites == 1, rows["suite"] + " " + rows["case"])


def aggregate(trials: pd.DataFrame, labels: Mapping[str, str] | None = None) -> pd.DataFrame:
    """One row per combination of `GROUP`, by suite and case in order of appearance, mass, impulse, and the paper's
    order of variants. labels: the paper's names of variants with another name here.

    Columns: `name_in_paper`, or else the name here; number of `trainings`, pooled; `trials`, `survived`, `succeeded`;
    `held` (trials with an object in the hands) and `carried` (those that carried its weight); `pushed` and `kept`
    (those that did not lose the object); success `rate` with its Wilson interval `rate_low`, `rate_high`; means of all
    metrics over surviving trials, or over all trials for `OVER_ALL_TRIALS`; `<error>_half`, half the 95 % interval of
    an error; `norm` of the four errors; `torque_rms` of the joint with the largest mean, and its name
    `torque_rms_joint`. Intervals use `WORLD` as clusters. NaN if no trial survived ("Fails" in the tables), for half
    widths also if only one did. Metrics that trials of an earlier version lack are missing here, too.
    """
    of_later_versions = ("E_v_raw", "E_v_raw_moving", *OVER_ALL_TRIALS, *SETTINGS)
    missing = [name for name in of_later_versions if name not in trials]
    trials = with_trainings(trials).assign(**dict.fromkeys(missing, np.nan))
    numbers = [name for name in trials.select_dtypes("float") if name not in (*GROUP, *SETTINGS)]
    metrics = [name for name in numbers if not name.startswith("drawn_")]
    groups = trials.groupby(GROUP, sort=False)
    table = pd.DataFrame([_row(dict(zip(GROUP, key, strict=True)), group, metrics) for key, group in groups])
    table["name_in_paper"] = table["variant"].replace(dict(labels or {}))
    ranks = {name: list(dict.fromkeys(trials[name])) for name in ("suite", "case")} | {"variant": variants_of(trials)}
    order = ["suite", "case", "mass", "impulse", "variant"]
    return table.sort_values(
        order, key=lambda values: values.map(ranks[values.name].index) if values.name in ranks else values
    ).reset_index(drop=True)


def _row(key: dict[str, object], group: pd.DataFrame, metrics: list[str]) -> dict[str, Any]:
    survivors = group[group["survived"]]
    succeeded, held = int(group["succeeded"].sum()), group["weight_in_hands"].notna()
    pushed = group["object_beside"].notna() & (group["drawn_rolling_resistance"] > 0.0)
    design = design_effect(group["succeeded"].to_numpy(bool), group[WORLD].to_numpy())
    low, high = wilson_interval(succeeded, len(group), design)
    row: dict[str, Any] = {
        **key,
        "trainings": group[TRAINING].nunique(),
        "trials": len(group),
        "survived": len(survivors),
        "succeeded": succeeded,
        "held": int(held.sum()),
        "carried": int(group["carried"].sum()),
        "pushed": int(pushed.sum()),
        "kept": int((group["kept"] & pushed).sum()),
        "rate": succeeded / len(group),
        "rate_low": low,
        "rate_high": high,
        **survivors[metrics].mean().to_dict(),
        **group[[*OVER_ALL_TRIALS, *STILL]].mean().to_dict(),
        **group[[*SETTINGS]].iloc[0].to_dict(),
    }
    for name in ALL_ERRORS:
        known = survivors[[WORLD, name]].dropna()
        row[name] = float(known[name].mean())
        row[f"{name}_half"] = mean_half_width(known[name].to_numpy(np.float64), known[WORLD].to_numpy())
    row["norm"] = float(error_norm(np.array([row[name] for name in ERRORS])))
    by_joint = {name: row[name] for name in metrics if name.startswith(f"{TORQUE}/")}
    worst = max(by_joint, key=lambda name: by_joint[name], default="")
    return row | {TORQUE: by_joint.get(worst, np.nan), f"{TORQUE}_joint": worst.removeprefix(f"{TORQUE}/")}


def with_trainings(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials with the column `TRAINING`; if it is missing, all belong to one training."""
    return trials if TRAINING in trials else trials.assign(**{TRAINING: "0"})


def variants_of(trials: pd.DataFrame) -> list[str]:
    """Variants in the paper's order, then any others in order of appearance."""
    return sorted(
        dict.fromkeys(trials["variant"]), key=lambda name: VARIANTS.index(name) if name in VARIANTS else len(VARIANTS)
    )


def stepping_commanded(rows: pd.DataFrame) -> bool:
    """True if any of these trials commands stepping, as the paper's do; errors of standing are not comparable."""
    return bool(rows["still_E_v_moving"].notna().any())


def suites_of(summary: pd.DataFrame, *kinds: str) -> list[str]:
    """Suites of the given kinds, in order of appearance."""
    return [str(suite) for suite in dict.fromkeys(summary.loc[summary["kind"].isin(kinds), "suite"])]
