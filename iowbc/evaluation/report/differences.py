"""Whether variants differ: trials of one seed are compared in pairs."""

import numpy as np
import pandas as pd

from iowbc.evaluation.report.aggregate import TRAINING, WORLD, variants_of, with_trainings
from iowbc.evaluation.report.captions import in_common
from iowbc.evaluation.report.error_tables import HEADS, LATEX_HEADS, STANDS_STILL
from iowbc.evaluation.report.statistics import mean_half_width, mean_p, sign_flip_p
from iowbc.evaluation.report.tables import ABSENT, Table
from iowbc.evaluation.trials.errors import ERRORS

PAIR = ["suite", "case", "mass", "impulse", "trial", "training"]
"""What two trials have in common that meet the same world and commands; the first training of a variant is compared
with the first of the other, and so on."""


def paired(trials: pd.DataFrame, variant: str, reference: str) -> pd.DataFrame:
    """The trials of two variants side by side, with the suffixes `_variant` and `_reference`."""
    columns = [*PAIR, "survived", "succeeded", *ERRORS]
    trials = with_trainings(trials)
    places = trials.groupby("variant")[TRAINING].transform(lambda seeds: pd.factorize(seeds)[0])
    trials = trials.assign(training=places)
    own, other = (trials.loc[trials["variant"] == name, columns] for name in (variant, reference))
    return own.merge(other, on=PAIR, suffixes=("_variant", "_reference"), validate="one_to_one")


def mean_difference(values: pd.Series, worlds: pd.Series) -> tuple[float, float, float]:
    """Mean of paired differences, half its 95 % interval, Student's p of no difference, with the worlds (n,) that they
    were met in as clusters; NaN of too few or equal."""
    differences, clusters = values.to_numpy(np.float64), worlds.to_numpy()
    if len(differences) < 2 or np.allclose(differences, differences[0]):
        return float(np.mean(differences)) if len(differences) else np.nan, np.nan, np.nan
    return float(differences.mean()), mean_half_width(differences, clusters), mean_p(differences, clusters)


def success_p(pairs: pd.DataFrame) -> float:
    """Exact p of equal success if the variants' names might be exchanged in each world; 1 where no pair differs.
    McNemar's where no two pairs share a world."""
    better = pairs["succeeded_variant"].astype(int) - pairs["succeeded_reference"].astype(int)
    return sign_flip_p(better.groupby(pairs[WORLD]).sum().to_numpy(np.int64))


def difference_table(trials: pd.DataFrame) -> Table | None:
    """How each variant differs from the first, over all masses of each suite; None for a single variant."""
    reference, *others = variants_of(trials)
    rows, numbers = [], []
    for suite in dict.fromkeys(trials["suite"]):
        within = trials[trials["suite"] == suite]
        for variant in others:
            pairs = paired(within, variant, reference)
            if pairs.empty:
                continue
            both = pairs[pairs["survived_variant"] & pairs["survived_reference"]]
            found = {
                name: mean_difference(both[f"{name}_variant"] - both[f"{name}_reference"], both[WORLD])
                for name in ERRORS
            }
            success = float(pairs["succeeded_variant"].mean() - pairs["succeeded_reference"].mean())
            p = success_p(pairs)
            cells = [_cell(*found[name]) for name in ERRORS]
            rows.append((suite, variant, str(len(both)), *cells, f"{100 * success:+.0f} % (p {p:.2g})"))
            numbers.append(
                {"suite": suite, "variant": variant, "reference": reference, "pairs": len(pairs), "both": len(both)}
                | {
                    f"{name}{part}": value
                    for name in ERRORS
                    for part, value in zip(("", "_half", "_p"), found[name], strict=True)
                }
                | {"success": success, "success_p": p}
            )
        if rows and rows[-1][0] == suite:
            survivors = within[(within["variant"] == reference) & within["survived"]]
            still = {
                name: mean_difference(survivors[f"still_{name}"] - survivors[name], survivors[WORLD]) for name in ERRORS
            }
            rows.append((suite, STANDS_STILL, str(len(survivors)), *(_cell(*still[name]) for name in ERRORS), ABSENT))
            numbers.append(
                {"suite": suite, "variant": STANDS_STILL, "reference": reference, "both": len(survivors)}
                | {name: still[name][0] for name in ERRORS}
            )
    if not rows:
        return None
    return Table(
        "differences",
        f"Differences to {reference} in pairs of trials that met the same world and commands, over all masses of a "
        "suite: errors where both survived, with their 95 % interval and Student's p; success with an exact p. Both "
        "take the worlds as clusters, in each of which all masses and trainings stand or fall together. "
        f"Negative errors are better. No p is corrected for how many there are. {STANDS_STILL}: what doing nothing "
        f"scores, from the script, against the trials that {reference} survived. {in_common(trials)}",
        ("Suite", "Algorithm", "Pairs", *(f"Δ{head}" for head in HEADS.values()), "Δ success"),
        (
            "Suite",
            "Algorithm",
            "Pairs",
            *(rf"$\Delta {head[1:]}" for head in LATEX_HEADS.values()),
            r"$\Delta$ success",
        ),
        tuple(rows),
        pd.DataFrame(numbers),
    )


def _cell(mean: float, half: float, p: float) -> str:
    if np.isnan(mean):
        return ABSENT
    return f"{mean:+.3f}" if np.isnan(half) else f"{mean:+.3f} ± {half:.3f} (p {p:.2g})"
