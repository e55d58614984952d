"""What all masses of a suite, and all trainings of a variant, come to: interquartile means with bootstrap intervals.

After R. Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical Precipice" (2021): the mean of the
middle half of all trials, an interval by resampling, and the probability that a variant improves on another. A trial
that was not survived is worse than any that was, so that nobody gains by falling early. What is drawn again is
trainings and worlds: trial k is the same world at every mass, and a training the same policy.
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from iowbc.evaluation.report.aggregate import TRAINING, variants_of, with_trainings
from iowbc.evaluation.report.captions import in_common
from iowbc.evaluation.report.error_tables import HEADS, LATEX_HEADS, STANDS_STILL, SWEPT, asks_for_transport
from iowbc.evaluation.report.statistics import RESAMPLES, interquartile_mean, percentile_interval
from iowbc.evaluation.report.tables import ABSENT, FAILS, Table
from iowbc.evaluation.trials.errors import ERRORS, error_norm

KINDS = (*SWEPT, "heavy", "robustness")
"""Kinds of suites in which errors tell how good a controller is."""
SUCCESS, NORM = "success", "norm"
FIGURES = (SUCCESS, *ERRORS, NORM)
"""What is told of a trial."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, resampled: Values) -> "Estimate":
        return cls(float(value), *percentile_interval(resampled))


@dataclass(frozen=True)
class Block:
    """Trials of a variant in one suite."""

    trainings: tuple[str, ...]
    """Their seeds."""
    values: Values
    """(trainings, masses or cases, trials, figures), by `FIGURES`; infinite errors where a trial was not survived."""

    def alone(self, place: int) -> "Block":
        """The trials of one training."""
        return Block(self.trainings[place : place + 1], self.values[place : place + 1])


def interquartile_table(trials: pd.DataFrame) -> Table | None:
    """A row for each suite and variant, then for each of its trainings where there are several; None without suites."""
    rows, numbers = [], []
    played = trials[trials["kind"].isin(KINDS)]
    for suite in dict.fromkeys(played["suite"]):
        within = played[played["suite"] == suite]
        found = blocks(within)
        first = next(iter(found), "")
        for variant, block in found.items():
            several = range(len(block.trainings)) if len(block.trainings) > 1 else range(0)
            shown = {variant: block} | {
                f"{variant}, seed {block.trainings[place]}": block.alone(place) for place in several
            }
            for name, part in shown.items():
                estimates = figures(part)
                if variant != first:
                    estimates["P"] = improvement(part, found[first])
                count = part.values.shape[0] * part.values.shape[1] * part.values.shape[2]
                rows.append((suite, name, str(len(part.trainings)), str(count), *_cells(estimates)))
                numbers.append({"suite": suite, "variant": name, "seeds": len(part.trainings), "trials": count})
                for key, one in estimates.items():
                    numbers[-1] |= {key: one.value, f"{key}_low": one.low, f"{key}_high": one.high}
        if found:
            still = {name: float(interquartile_mean(within[f"still_{name}"].to_numpy(np.float64))) for name in ERRORS}
            achieved = "none" if asks_for_transport(within) else ABSENT
            cells = [f"{value:.3f}" for value in still.values()]
            rows.append((suite, STANDS_STILL, ABSENT, ABSENT, achieved, *cells, ABSENT))
            numbers.append({"suite": suite, "variant": STANDS_STILL, **still})
    if not rows:
        return None
    columns = ("Suite", "Algorithm", "Seeds", "Trials", "Success")
    return Table(
        "interquartile",
        "All masses or cases of a suite together that every variant played: success, and interquartile means of the "
        "errors (of the middle half of all trials), with 95 % intervals by bootstrap over trainings and worlds. A "
        f"trial that was not survived counts as worse than any other; {FAILS}: such trials reach into the middle half. "
        "P: probability that a trial has a smaller norm of the four errors than one of the first algorithm at the same "
        "mass. Few trainings say little of how much another one would differ: their own rows stand below. "
        f"{STANDS_STILL}: what doing nothing scores, from the script. {in_common(played)}",
        (*columns, *HEADS.values(), "P"),
        (*columns, *LATEX_HEADS.values(), "P"),
        tuple(rows),
        pd.DataFrame(numbers),
    )


def blocks(trials: pd.DataFrame) -> dict[str, Block]:
    """The trials of each variant in one suite, at the masses or cases that every training of all of them has played."""
    trials = with_trainings(trials)
    told = trials.assign(**{SUCCESS: trials["succeeded"].astype(float)})
    told[list(ERRORS)] = told[list(ERRORS)].where(told["survived"], np.inf)
    told[NORM] = error_norm(told[list(ERRORS)].to_numpy(np.float64))
    groups: dict[tuple[str, str], dict[Hashable, pd.DataFrame]] = {
        (str(variant), str(training)): dict(iter(own.sort_values("trial").groupby(["case", "mass"])))
        for (variant, training), own in told.groupby(["variant", TRAINING], sort=False)
    }
    common = [part for part in next(iter(groups.values())) if all(part in own for own in groups.values())]
    count = min((len(own[part]) for own in groups.values() for part in common), default=0)
    found = {}
    for variant in variants_of(trials) if count else ():
        own = {training: parts for (name, training), parts in groups.items() if name == variant}
        values = [[parts[part][list(FIGURES)].to_numpy()[:count] for part in common] for parts in own.values()]
        found[variant] = Block(tuple(own), np.array(values, np.float64))
    return found


def figures(block: Block) -> dict[str, Estimate]:
    """Mean success and interquartile mean of each error."""
    trainings, _, trials, _ = block.values.shape
    drawn, worlds = _drawn(trainings, trials)
    resampled = block.values[drawn[:, :, None], :, worlds[:, None, :]].reshape(RESAMPLES, -1, len(FIGURES))
    flat = block.values.reshape(-1, len(FIGURES))
    found = {SUCCESS: Estimate.of(flat[:, 0].mean(), resampled[..., 0].mean(axis=1))}
    for name in ERRORS:
        place = FIGURES.index(name)
        whole = float(interquartile_mean(flat[:, place]))
        found[name] = Estimate.of(whole, interquartile_mean(resampled[..., place]))
    return found


def improvement(block: Block, reference: Block) -> Estimate:
    """Probability that a trial has a smaller norm of errors than one of the reference at the same mass; ties half."""
    own, other = (one.values[..., FIGURES.index(NORM)].swapaxes(1, 2) for one in (block, reference))
    own, other = own[:, :, None, None], other[None, None]  # (trainings, trials, its trainings, its trials, masses)
    wins = ((own < other) + 0.5 * (own == other)).mean(axis=-1)
    drawn, worlds = _drawn(wins.shape[0], wins.shape[1])
    others, _ = _drawn(wins.shape[2], wins.shape[1], seed=1)
    resampled = wins[
        drawn[:, :, None, None, None],
        worlds[:, None, :, None, None],
        others[:, None, None, :, None],
        worlds[:, None, None, None, :],
    ]
    return Estimate.of(wins.mean(), resampled.mean(axis=(1, 2, 3, 4)))


def _drawn(trainings: int, trials: int, seed: int = 0) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Trainings and worlds of each resample, with replacement: (resamples, trainings), (resamples, trials)."""
    worlds = np.random.default_rng(0).integers(trials, size=(RESAMPLES, trials))
    return np.random.default_rng([seed, trainings]).integers(trainings, size=(RESAMPLES, trainings)), worlds


def _cells(estimates: dict[str, Estimate]) -> list[str]:
    success, chance = estimates[SUCCESS], estimates.get("P")
    return [
        f"{100 * success.value:.0f} % ({100 * success.low:.0f} to {100 * success.high:.0f})",
        *(_error(estimates[name]) for name in ERRORS),
        ABSENT if chance is None else f"{chance.value:.2f} ({chance.low:.2f} to {chance.high:.2f})",
    ]


def _error(estimate: Estimate) -> str:
    ends = (estimate.value, estimate.low, estimate.high)
    value, low, high = (f"{end:.3f}" if np.isfinite(end) else FAILS for end in ends)
    return value if value == low == high else f"{value} ({low} to {high})"
