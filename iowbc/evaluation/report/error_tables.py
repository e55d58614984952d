"""Tables of tracking errors in the paper's own form (II and III), beside its numbers and a robot that stands still."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import VARIANTS, reported
from iowbc.evaluation.report.aggregate import asks_for_steps
from iowbc.evaluation.report.captions import conditions, measures
from iowbc.evaluation.report.regime import regime
from iowbc.evaluation.report.tables import ABSENT, FAILS, Table
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.transport import SHORTEST_WAY

HEADS = {"E_alpha": "E_α [rad]", "E_h": "E_h [m]", "E_v": "E_v [m/s]", "E_psi": "E_ψ [rad]"}
LATEX_HEADS = {"E_alpha": r"$E_{\alpha}$", "E_h": "$E_{h}$", "E_v": "$E_{v}$", "E_psi": r"$E_{\psi}$"}
RAW = "E_v_raw"
"""E_v without the mean over a gait period."""
TOLD = {name: HEADS.get(name, "E_v raw [m/s]") for name in ("E_alpha", "E_h", "E_v", RAW, "E_psi")}
LATEX_TOLD = {name: LATEX_HEADS.get(name, "$E_{v}$ raw") for name in TOLD}
"""Heads of the errors with it."""
NUMBERS = {"lifting": "II", "pushing": "III"}
SWEPT = (*NUMBERS, "squeezing")
"""Kinds of suites that go over masses; the paper has no table of the last."""
STANDS_STILL = "stands still"
"""The row of a robot that does nothing, computed from the script: who scores no better has done nothing."""
ANY_MASS = "any"
NO_LABELS: Mapping[str, str] = MappingProxyType({})


def error_table(
    summary: pd.DataFrame, suite: str, labels: Mapping[str, str] = NO_LABELS, name: str | None = None
) -> Table:
    """Errors over the whole trial by mass or case and variant, with survival, success, transport, what is kept.

    labels: the paper's name of variants that go by another one here; where it knows none, its columns are left out.
    name: of the table; that of the suite by default.
    """
    chosen = summary[summary["suite"] == suite]
    kind = str(chosen["kind"].iloc[0])
    swept = kind in SWEPT
    known = any(labels.get(str(variant), str(variant)) in VARIANTS for variant in chosen["variant"])
    with_paper = kind in NUMBERS and known and asks_for_steps(chosen)
    rows = []
    for first, group in _groups(chosen, swept):
        for _, row in group.iterrows():
            variant = str(row["variant"])
            theirs = _theirs(summary, row, labels.get(variant, variant)) if with_paper else []
            rows.append((first, variant, *_errors(row), *_outcome(row), *theirs))
        if not swept:
            rows.append((first, STANDS_STILL, *_still(group), *_still_outcome(group)))
    if swept:
        nothing = [ABSENT] * len(ERRORS) if with_paper else []
        rows.append((ANY_MASS, STANDS_STILL, *_still(chosen), *_still_outcome(chosen), *nothing))
    columns = ("Mass" if swept else "Case", "Algorithm")
    outcome = ("Survived", "Success", "Transport", "Kept")
    paper = [f"paper {head.split()[0]}" for head in HEADS.values() if with_paper]
    latex_paper = [f"paper {head}" for head in LATEX_HEADS.values() if with_paper]
    return Table(
        name=name or slug(suite),
        caption=_caption(chosen, kind, with_paper),
        head=(*columns, *TOLD.values(), *outcome, *paper),
        latex_head=(*columns, *LATEX_TOLD.values(), *outcome, *latex_paper),
        rows=tuple(rows),
        numbers=_with_papers(chosen, kind, labels) if with_paper else chosen,
    )


def moving_table(summary: pd.DataFrame, suite: str) -> Table:
    """The errors over the part of the trials in which steps are asked for."""
    chosen = summary[summary["suite"] == suite]
    swept = str(chosen["kind"].iloc[0]) in SWEPT
    rows = []
    for first, group in _groups(chosen, swept):
        rows += [(first, str(row["variant"]), *_errors(row, "_moving")) for _, row in group.iterrows()]
        if not swept:
            rows.append((first, STANDS_STILL, *_still(group, "_moving")))
    if swept:
        rows.append((ANY_MASS, STANDS_STILL, *_still(chosen, "_moving")))
    columns = ("Mass" if swept else "Case", "Algorithm")
    return Table(
        name=f"{slug(suite)}_moving",
        caption=f"Command tracking errors in {suite} while steps are asked for: means over surviving trials with their "
        f"95 % interval. {conditions(chosen)} {measures(chosen)}",
        head=(*columns, *TOLD.values()),
        latex_head=(*columns, *LATEX_TOLD.values()),
        rows=tuple(rows),
        numbers=chosen,
    )


def slug(suite: str) -> str:
    """A suite's name as that of a file."""
    return suite.replace(" ", "_")


def _groups(chosen: pd.DataFrame, swept: bool) -> list[tuple[str, pd.DataFrame]]:
    """The rows of each mass, or case with its mass, with what stands in the first column."""
    groups = [(str(case), float(mass), group) for (case, mass), group in chosen.groupby(["case", "mass"], sort=False)]
    by_mass = set(chosen["suite"]) if swept else set()
    return [
        (f"{mass:g} kg" if case in by_mass else case if swept else f"{case} ({mass:g} kg)", group)
        for case, mass, group in groups
    ]


def _errors(row: pd.Series, part: str = "") -> list[str]:
    if not row["survived"]:
        return [FAILS] * len(TOLD)
    halves = [row.get(f"{name}{part}_half", np.nan) for name in TOLD]
    return [with_half(row[f"{name}{part}"], half) for name, half in zip(TOLD, halves, strict=True)]


def _outcome(row: pd.Series) -> list[str]:
    ways = (float(row["transport_robot"]), float(row["transport_object"]))
    share = float(row["weight_in_hands"])
    in_hands = ABSENT if np.isnan(share) else f"{100 * share:.0f} %"
    return [
        f"{row['survived']}/{row['trials']}",
        f"{row['succeeded']}/{row['trials']}",
        " / ".join(f"{way:.2f}" for way in ways if not np.isnan(way)) or ABSENT,
        f"{row['kept']}/{row['pushed']}" if row["pushed"] else in_hands,
    ]


def _still(rows: pd.DataFrame, part: str = "") -> list[str]:
    names = ["E_v" if name == RAW else name for name in TOLD]
    values = [float(rows[f"still_{name}{part}"].mean()) for name in names]
    return [ABSENT if np.isnan(value) else f"{value:.3f}" for value in values]


def asks_for_transport(rows: pd.DataFrame) -> bool:
    """Whether any of these trials commands a way that has to be covered."""
    return bool((rows["commanded_distance"] >= SHORTEST_WAY).any()) and not (rows["kind"] == "stagnation").all()


def _still_outcome(rows: pd.DataFrame) -> list[str]:
    walks = asks_for_transport(rows)
    return [ABSENT, "none" if walks else ABSENT, "0.00" if walks else ABSENT, ABSENT]


def _theirs(summary: pd.DataFrame, row: pd.Series, variant: str) -> list[str]:
    """The paper's errors, and in brackets ours in parts of them; of pushes with what it does not say."""
    paper = reported(str(row["kind"]), float(row["mass"]), variant)
    if paper == "absent":
        return [ABSENT] * len(ERRORS)
    if paper is None:
        return [FAILS] * len(ERRORS)
    cells = []
    for name, value in zip(ERRORS, paper, strict=True):
        ratio = float(row[name]) / value
        said = ([] if np.isnan(ratio) else [f"{ratio:.2f}"]) + regime(summary, row, name)
        cells.append(f"{value:.3f} ({'; '.join(said)})" if said else f"{value:.3f}")
    return cells


def _with_papers(chosen: pd.DataFrame, kind: str, labels: Mapping[str, str]) -> pd.DataFrame:
    """The numbers with the paper's, `paper_<error>`, and ours in parts of them, `ratio_<error>`; NaN without any."""
    found = [
        reported(kind, float(row["mass"]), labels.get(row["variant"], row["variant"])) for _, row in chosen.iterrows()
    ]
    paper = np.array([[np.nan] * len(ERRORS) if one is None or one == "absent" else one for one in found], np.float64)
    columns = {f"paper_{name}": paper[:, place] for place, name in enumerate(ERRORS)}
    ratios = {f"ratio_{name}": chosen[name].to_numpy(np.float64) / columns[f"paper_{name}"] for name in ERRORS}
    return chosen.assign(**columns, **ratios)


def _caption(chosen: pd.DataFrame, kind: str, with_paper: bool) -> str:
    like = f" (paper's Table {NUMBERS[kind]})" if kind in NUMBERS and asks_for_steps(chosen) else ""
    title = f"{_with_whom(chosen, kind)}{like}" if kind in SWEPT else f"the suite {kind}"
    failed = f" {FAILS}: no trial survived." if (chosen["survived"] == 0).any() else ""
    aim = (
        " Success here is survival in posture on feet that stay, with a push that goes on: the crate cannot move."
        if kind == "stagnation"
        else ""
    )
    beside = (
        " Right, what the paper reports for its own commands, in brackets ours divided by it." if with_paper else ""
    )
    return (
        f"Command tracking errors under {title}: means over surviving trials with their 95 % interval. "
        f"{conditions(chosen)} {measures(chosen)} Transport: parts of the commanded way that robot / object covered; "
        f"kept: part of the weight that the robot carries which rests in its hands, or how often what is pushed is not "
        f"lost at its side; success: survived, with enough of both; {STANDS_STILL}: what doing nothing scores, from "
        f"the script.{failed}{aim}{beside}"
    )


def _with_whom(chosen: pd.DataFrame, kind: str) -> str:
    """What is done, as the paper says it, and that nobody helps where nobody does."""
    shares = set(chosen["partner_share"])
    if shares == {0.0}:
        return f"{kind} alone"
    return f"cooperative {kind}" if min(shares) > 0 else kind


def with_half(value: float, half: float) -> str:
    """A mean with half its interval; a dash for none."""
    if np.isnan(value):
        return ABSENT
    return f"{value:.3f}" if np.isnan(half) else f"{value:.3f} ± {half:.3f}"
