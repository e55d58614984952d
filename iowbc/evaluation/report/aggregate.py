"""From the long table of trials to one row for each variant, suite and mass."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from iowbc.evaluation.report.paper import VARIANTS
from iowbc.evaluation.report.statistics import mean_half_width, wilson_interval
from iowbc.evaluation.trials.metrics import ERRORS, error_norm

COSTS = ("E_v_raw", "saturation", "saturation_peak", "slip_share", "partner_force_peak", "grip_force_peak", "energy")
"""Other columns averaged over the surviving trials."""
GROUP = ["variant", "suite", "case", "mass"]


def aggregate(trials: pd.DataFrame) -> pd.DataFrame:
    """One row for each (variant, suite, case, mass), in order of suite, mass, and the paper's order of variants.

    Columns: `trials`, `survived`, `rate` with its Wilson interval `rate_low`, `rate_high`; each error's mean over the
    surviving trials and `<error>_half`, half its 95 % interval; `norm`, the norm of the four means. NaN where no trial
    survived (or one alone, for the half widths): "Fails" in the tables.
    """
    rows = [_row(dict(zip(GROUP, key, strict=True)), group) for key, group in trials.groupby(GROUP, sort=False)]
    table = pd.DataFrame(rows)
    rank = {variant: place for place, variant in enumerate(variants_of(trials))}
    order = table.assign(_rank=table["variant"].map(rank)).sort_values(["suite", "case", "mass", "_rank"])
    return order.drop(columns="_rank").reset_index(drop=True)


def _row(key: dict[str, object], group: pd.DataFrame) -> dict[str, object]:
    survivors = group[group["survived"]]
    low, high = wilson_interval(len(survivors), len(group))
    row: dict[str, object] = {
        **key,
        "trials": len(group),
        "survived": len(survivors),
        "rate": len(survivors) / len(group),
        "rate_low": low,
        "rate_high": high,
    }
    for name in ERRORS:
        values = survivors[name].to_numpy(np.float64)
        row[name] = float(values.mean()) if len(values) else np.nan
        row[f"{name}_half"] = mean_half_width(values)
    row["norm"] = float(error_norm(np.array([row[name] for name in ERRORS])))
    for name in COSTS:
        row[name] = float(survivors[name].mean()) if len(survivors) else np.nan
    return row


def variants_of(trials: pd.DataFrame) -> list[str]:
    """Variants in the paper's order, then any others in order of appearance."""
    present: Iterable[str] = dict.fromkeys(trials["variant"])
    return sorted(present, key=lambda name: VARIANTS.index(name) if name in VARIANTS else len(VARIANTS))


def load_capacity(summary: pd.DataFrame, suite: str, variant: str, rate: float) -> float | None:
    """The largest mass of a sweep [kg] up to which every mass reached the success rate, or None."""
    rows = summary[(summary["suite"] == suite) & (summary["variant"] == variant)].sort_values("mass")
    capacity = None
    for _, row in rows.iterrows():
        if row["rate"] < rate:
            break
        capacity = float(row["mass"])
    return capacity
