"""Paired differences between variants, in trials of the same seed."""

import numpy as np
import pandas as pd

from iowbc.evaluation.report.aggregate import WORLD, variants_of
from iowbc.evaluation.report.captions import in_common
from iowbc.evaluation.report.columns import HEADS, IDLE, STANDS_STILL
from iowbc.evaluation.report.statistics import mean_half_width, mean_p, sign_flip_p
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.results.table import ABSENT, Column, Table, heads, measured

PAIR = ["suite", "case", "mass", "impulse", "trial"]
"""Columns that identify a pair, trials with the same seed and commands: each training with each of the other variant.
"""
DRAWN = "drawn_"
"""Beginning of the columns with drawn quantities, which are equal in a pair if both recipes have the same world."""
WITHOUT_EFFECT = ("object_mass_scale",)
"""Drawn quantities that have no effect in trials, whose masses are given."""


def paired(trials: pd.DataFrame, variant: str, reference: str) -> pd.DataFrame:
    """Paired trials of two variants, with column suffixes `_variant` and `_reference`."""
    drawn = [name for name in trials.select_dtypes("number") if name.startswith(DRAWN)]
    trials = trials[["variant", *PAIR, "survived", "succeeded", *ERRORS, *drawn]]
    own, other = (trials[trials["variant"] == name].drop(columns="variant") for name in (variant, reference))
    return own.merge(other, on=PAIR, suffixes=("_variant", "_reference"))


def drawn_apart(pairs: pd.DataFrame) -> list[str]:
    """Drawn quantities that differ within paired trials, because the variants' recipes have other worlds."""
    names = [name.removesuffix("_variant") for name in pairs if name.startswith(DRAWN) and name.endswith("_variant")]
    own, other = (pairs[[f"{name}_{side}" for name in names]].to_numpy() for side in ("variant", "reference"))
    apart = ~np.isclose(own, other, equal_nan=True).all(axis=0)
    found = (name.removeprefix(DRAWN) for name, differs in zip(names, apart, strict=True) if differs)
    return [name.replace("_", " ") for name in found if name not in WITHOUT_EFFECT]


def mean_difference(values: pd.Series, worlds: pd.Series) -> tuple[float, float, float]:
    """Mean of paired differences, half its 95 % interval and p-value of Student's t-test, with the worlds, (n,), as
    clusters. Interval and p are NaN for fewer than two or equal values, the mean for none."""
    differences, clusters = values.to_numpy(np.float64), worlds.to_numpy()
    if len(differences) < 2 or np.allclose(differences, differences[0]):
        return float(np.mean(differences)) if len(differences) else np.nan, np.nan, np.nan
    return float(differences.mean()), mean_half_width(differences, clusters), mean_p(differences, clusters)


def success_p(pairs: pd.DataFrame) -> float:
    """Exact p-value of equal success, by permutation of the variants within each world; 1 if no pair differs."""
    better = pairs["succeeded_variant"].astype(int) - pairs["succeeded_reference"].astype(int)
    return sign_flip_p(better.groupby(pairs[WORLD]).sum().to_numpy(np.int64))


def difference_table(trials: pd.DataFrame) -> Table | None:
    """Differences of each variant to the first, over all masses of each suite; None if there are no pairs."""
    reference, *others = variants_of(trials)
    rows, numbers = [], []
    apart: dict[str, dict[str, None]] = {variant: {} for variant in others}

    def add(suite: str, variant: str, errors: pd.DataFrame, last: str, **figures: object) -> None:
        """Add a row of error differences; `errors` also holds the world of each."""
        found = {name: mean_difference(errors[name], errors[WORLD]) for name in ERRORS}
        cells = [measured(mean, half, "+.3f", note=f" (p {p:.2g})") for mean, half, p in found.values()]
        count = f"{len(errors)}/{figures['pairs']}" if figures else str(len(errors))
        rows.append((suite, variant, count, *cells, last))
        numbers.append({"suite": suite, "variant": variant, "reference": reference, **figures, "both": len(errors)})
        for name, values in found.items():
            parts = ("", "_half", "_p") if variant != STANDS_STILL else ("",)
            numbers[-1] |= {f"{name}{part}": value for part, value in zip(parts, values, strict=False)}

    for suite, within in trials.groupby("suite", sort=False):
        compared = {variant: pairs for variant in others if len(pairs := paired(within, variant, reference))}
        for variant, pairs in compared.items():
            apart[variant] |= dict.fromkeys(drawn_apart(pairs))
            both = pairs[pairs["survived_variant"] & pairs["survived_reference"]]
            errors = {name: both[f"{name}_variant"] - both[f"{name}_reference"] for name in ERRORS}
            success = float(pairs["succeeded_variant"].mean() - pairs["succeeded_reference"].mean())
            p = success_p(pairs)
            last = f"{100 * success:+.0f} % (p {p:.2g})"
            add(suite, variant, both[[WORLD]].assign(**errors), last, pairs=len(pairs))
            numbers[-1] |= {"success": success, "success_p": p}
        if compared:
            survivors = within[(within["variant"] == reference) & within["survived"]]
            errors = {name: survivors[f"still_{name}"] - survivors[name] for name in ERRORS}
            add(suite, STANDS_STILL, survivors[[WORLD]].assign(**errors), ABSENT)
    if not rows:
        return None
    worlds = "".join(
        f" {variant} and {reference} met different worlds ({', '.join(names)})."
        for variant, names in apart.items()
        if names
    )
    caption = (
        f"Differences to {reference} in pairs of trials with the same seed and commands, each training with each, over "
        f"all masses of a suite; pairs: those that both survived, of all.{worlds} Errors where both survived, with "
        "95 % interval and Student's p; success with an exact p. Both treat worlds as clusters, since the masses and "
        "trainings in a world are correlated, and hold for these trained policies: further trainings vary, too. "
        f"Negative errors are better. No p is corrected for multiple comparisons. {IDLE} It is compared with the "
        f"trials that {reference} survived. {in_common(trials)}"
    )
    columns = heads(
        *("Suite", "Algorithm", "Pairs"),
        *(Column(f"Δ{one.name}", one.unit, rf"$\Delta {one.latex[1:]}") for one in HEADS.values()),
        Column("Δ success", latex=r"$\Delta$ success"),
    )
    return Table("differences", caption, columns, rows, pd.DataFrame(numbers))
