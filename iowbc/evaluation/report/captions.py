"""Sentences of captions: partner, friction, trainings, meaning of the height, averaging of E_v."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import STAGNATING
from iowbc.results.table import FAILS

DRAWN = "drawn as in training"
HEIGHTS = {"pelvis": "the pelvis above the ground", "com": "the robot's centre of mass above the ground"}


def conditions(rows: pd.DataFrame) -> str:
    """The conditions of the trials in rows of a summary, in a sentence or two."""
    rolling = f", {rolling_resistance(rows)}" if (rows["kind"] == "pushing").any() else ""
    return f"In simulation, {partner(rows)}{rolling}.{trainings(rows)}"


def trainings(rows: pd.DataFrame) -> str:
    """The variants that were trained more than once."""
    several = rows[rows["trainings"] > 1].groupby("variant", sort=False)["trainings"].max()
    counts = ", ".join(f"{variant}: {count} trainings" for variant, count in several.items())
    return f" Trials of all trainings together ({counts})." if counts else ""


def measures(rows: pd.DataFrame) -> str:
    return (
        f"Errors against the command as given; height is that of {_by_variant(rows, 'height', HEIGHTS.__getitem__)}; "
        f"E_v with v_sys averaged over one gait period of {_by_variant(rows, 'gait_period', '{:.2f} s'.format)}."
    )


def _by_variant(rows: pd.DataFrame, column: str, text: Callable[[Any], str]) -> str:
    """The text of a column's value; where variants differ, that of each value with its variants in brackets."""
    variants = rows.groupby(rows[column].map(text), sort=False)["variant"].unique()
    several = ", ".join(f"{value} ({', '.join(own)})" for value, own in variants.items())
    return several if len(variants) > 1 else str(variants.index[0])


def in_common(rows: pd.DataFrame) -> str:
    """The conditions that trials of several suites share, and the measurement of their errors."""
    pushes = rows[rows["kind"] == "pushing"]
    rolling = "" if pushes.empty else f", pushes with {rolling_resistance(pushes)}"
    return f"In simulation{rolling}. {measures(rows)}"


def partner(rows: pd.DataFrame) -> str:
    shares = rows["partner_share"].unique()
    if len(shares) > 1:
        return "the partner's share by case"
    share = float(shares[0])
    if np.isnan(share):
        return f"the partner's share {DRAWN}"
    return "without a partner (share 0)" if share == 0 else f"with a partner (share {share:g})"


def rolling_resistance(rows: pd.DataFrame) -> str:
    found = _by_variant(rows, "rolling_resistance", lambda value: f"μ {value:g}" if value >= 0 else DRAWN)
    return f"rolling resistance {found}"


def regime(summary: pd.DataFrame, row: pd.Series, error: str) -> list[str]:
    """Notes beside the paper's E_v at the mass of a row of a summary: that its μ is unknown, and our E_v at the same
    mass and partner's share and at μ from `STAGNATING`, where our crates stagnate like the paper's. Empty for other
    errors or without load."""
    if error != "E_v" or row["kind"] != "pushing" or not row["mass"] > 0:
        return []
    alike = summary[
        (summary["kind"] == "map")
        & (summary["variant"] == row["variant"])
        & (summary["mass"] == row["mass"])
        & summary["partner_share"].isin([row["partner_share"]])
        & (summary["rolling_resistance"] >= STAGNATING)
    ]
    pairs = zip(alike["E_v"], alike["rolling_resistance"], strict=True)
    ours = ", ".join(f"{FAILS if np.isnan(own) else format(own, '.3f')} at μ {friction:g}" for own, friction in pairs)
    return ["the paper's μ is unknown", *([f"ours in its regime {ours}"] if ours else [])]
