"""Interquartile means over all masses of a suite and all trainings of a variant, with bootstrap intervals.

After R. Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical Precipice" (2021): the mean of the
middle half of all trials, a bootstrap interval, and the probability that a variant improves on another. A trial that
was not survived ranks below all others, so that falling early gives no advantage. The bootstrap resamples trainings and
worlds, since trial k is the same world at every mass and a training the same policy.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from iowbc.evaluation.report.aggregate import TRAINING, variants_of, with_trainings
from iowbc.evaluation.report.captions import in_common
from iowbc.evaluation.report.columns import HEADS, IDLE, STANDS_STILL, transport_commanded
from iowbc.evaluation.report.error_tables import SWEPT
from iowbc.evaluation.report.statistics import RESAMPLES, Bootstrapped, bootstrapped, interquartile_mean
from iowbc.evaluation.trials.errors import ERRORS, error_norm
from iowbc.results.table import ABSENT, FAILS, Table, heads

KINDS = (*SWEPT, "heavy", "robustness")
"""Kinds of suites in which controllers are compared by errors."""
FIGURES = ("success", *ERRORS, "norm")
"""Metrics of a trial."""

Values = NDArray[np.float64]
Block = dict[str, Values]
"""By training seed: (masses or cases, trials, metrics in order of `FIGURES`); errors are infinite unless survived."""


def interquartile_table(trials: pd.DataFrame) -> Table | None:
    """A row per suite and variant, then one per training if there are several; None without suites."""
    rows, numbers = [], []
    played = trials[trials["kind"].isin(KINDS)]
    for suite, within in played.groupby("suite", sort=False):
        found = blocks(within)
        for place, (variant, block) in enumerate(found.items()):
            alone = {f"{variant}, seed {seed}": {seed: values} for seed, values in block.items() if len(block) > 1}
            for name, part in ({variant: block} | alone).items():
                estimates = figures(part)
                if place:
                    estimates["P"] = improvement(part, next(iter(found.values())))
                count = sum(values.shape[0] * values.shape[1] for values in part.values())
                rows.append((str(suite), name, str(len(part)), str(count), *_cells(estimates)))
                numbers.append({"suite": suite, "variant": name, "seeds": len(part), "trials": count})
                for key, one in estimates.items():
                    numbers[-1] |= one.named(key)
        if found:
            common = common_rows(within)
            still = {name: float(interquartile_mean(common[f"still_{name}"].to_numpy(np.float64))) for name in ERRORS}
            achieved = "none" if transport_commanded(within) else ABSENT
            cells = [f"{value:.3f}" for value in still.values()]
            rows.append((str(suite), STANDS_STILL, ABSENT, ABSENT, achieved, *cells, ABSENT))
            numbers.append({"suite": suite, "variant": STANDS_STILL, **still})
    if not rows:
        return None
    caption = (
        "Success, and interquartile means of the errors (means of the middle half of all trials), over all masses or "
        "cases of a suite that every variant played, in the same number of worlds; 95 % bootstrap intervals over "
        "trainings and worlds. A trial that was not survived ranks below all others; "
        f"{FAILS}: such trials are in the middle half. "
        "P: probability that a trial has a smaller norm of the four errors than one of the first algorithm at the same "
        "mass. Few trainings show little of the spread between trainings; each has a row of its own. "
        f"{IDLE} {in_common(played)}"
    )
    columns = heads("Suite", "Algorithm", "Seeds", "Trials", "Success", *HEADS.values(), "P")
    return Table("interquartile", caption, columns, rows, pd.DataFrame(numbers))


def blocks(trials: pd.DataFrame) -> dict[str, Block]:
    """The common rows of each variant in one suite."""
    trials = common_rows(trials)
    trials = trials.assign(success=trials["succeeded"].astype(float))
    trials[list(ERRORS)] = trials[list(ERRORS)].where(trials["survived"], np.inf)
    trials["norm"] = error_norm(trials[list(ERRORS)].to_numpy(np.float64))
    found: dict[str, Block] = {variant: {} for variant in variants_of(trials)}
    for (variant, training), own in trials.groupby(["variant", TRAINING], sort=False):
        cells = [cell[list(FIGURES)].to_numpy(np.float64) for _, cell in own.groupby(["case", "mass"])]
        found[variant][str(training)] = np.array(cells)
    return found


def common_rows(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials at the masses or cases common to all trainings of all variants, as many first ones of each, by number."""
    trials, part, training = with_trainings(trials), ["case", "mass"], ["variant", TRAINING]
    trials = trials.sort_values("trial", kind="stable")
    counts = trials.groupby([*part, *training]).size().unstack(training).dropna()
    count = int(counts.to_numpy().min()) if len(counts) else 0
    common = pd.MultiIndex.from_frame(trials[part]).isin(counts.index)
    return trials[common & (trials.groupby([*part, *training]).cumcount() < count)]


def figures(block: Block) -> dict[str, Bootstrapped]:
    """Mean success and interquartile mean of each error."""
    values = np.array(list(block.values()))
    drawn, worlds = _drawn(values.shape[0], values.shape[2])
    resampled = values[drawn[:, :, None], :, worlds[:, None, :]].reshape(RESAMPLES, -1, len(FIGURES))
    flat = values.reshape(-1, len(FIGURES))
    found = {"success": bootstrapped(flat[:, 0].mean(), resampled[..., 0].mean(axis=1))}
    for place, name in enumerate(ERRORS, 1):
        found[name] = bootstrapped(interquartile_mean(flat[:, place]), interquartile_mean(resampled[..., place]))
    return found


def improvement(block: Block, reference: Block) -> Bootstrapped:
    """Probability that a trial has a smaller error norm than one of the reference at the same mass; ties count half."""
    own, other = (np.array(list(one.values()))[..., -1].swapaxes(1, 2) for one in (block, reference))
    own, other = own[:, :, None, None], other[None, None]  # (trainings, trials) of own, then other; masses
    wins = ((own < other) + 0.5 * (own == other)).mean(axis=-1)
    drawn, worlds = _drawn(wins.shape[0], wins.shape[1])
    others, _ = _drawn(wins.shape[2], wins.shape[1], seed=1)
    resampled = wins[
        drawn[:, :, None, None, None],
        worlds[:, None, :, None, None],
        others[:, None, None, :, None],
        worlds[:, None, None, None, :],
    ]
    return bootstrapped(wins.mean(), resampled.mean(axis=(1, 2, 3, 4)))


def _drawn(trainings: int, trials: int, seed: int = 0) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Trainings and worlds drawn with replacement: (resamples, trainings), (resamples, trials)."""
    worlds = np.random.default_rng(0).integers(trials, size=(RESAMPLES, trials))
    return np.random.default_rng([seed, trainings]).integers(trainings, size=(RESAMPLES, trainings)), worlds


def _cells(estimates: Mapping[str, Bootstrapped]) -> list[str]:
    success, chance = estimates["success"], estimates.get("P")
    errors = [[f"{end:.3f}" if np.isfinite(end) else FAILS for end in estimates[name]] for name in ERRORS]
    return [
        f"{100 * success.value:.0f} % ({100 * success.low:.0f} to {100 * success.high:.0f})",
        *(value if value == low == high else f"{value} ({low} to {high})" for value, low, high in errors),
        ABSENT if chance is None else f"{chance.value:.2f} ({chance.low:.2f} to {chance.high:.2f})",
    ]
