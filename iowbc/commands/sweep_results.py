"""Results of a sweep: a table over its settings, seeds together, and every point's metrics."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import JsonValue

from iowbc.commands.lookup import SWEEP_POINTS, SWEEP_TABLE
from iowbc.commands.results import headline
from iowbc.evaluation.report.statistics import mean_half_width
from iowbc.recipe.recipe import PIPELINE, SEEDS
from iowbc.recipe.sweep import Point, Sweep, written
from iowbc.report.runs import Run
from iowbc.results.table import Table, heads, markdown, measured

OUTCOMES_SHOWN = 6
"""Maximum number of metrics in the table; those of the last stages come first."""


@dataclass(frozen=True)
class Line:
    """The points that differ in their seeds alone."""

    label: str
    settings: Mapping[str, JsonValue]
    """By the last word of their paths, or the whole path where two end alike."""
    runs: int
    figures: Mapping[str, tuple[float, float]]
    """Mean and half its interval of each outcome, NaN where there is none; all lines have the same outcomes."""


def outcomes(sweep: Sweep, found: Mapping[str, Run]) -> list[Line]:
    """A line for each setting, seeds together; `found`: the finished points by name, at least one."""
    settings = [path for path in sweep.axes if path not in SEEDS]
    last_words = [path.rpartition(".")[2] for path in settings]
    names = [word if last_words.count(word) == 1 else path for word, path in zip(last_words, settings, strict=True)]
    points = [point for point in sweep.points if point.name in found]
    metrics = _chosen([found[point.name] for point in points])
    groups: dict[tuple[str, ...], list[Point]] = {}
    for point in points:
        groups.setdefault(tuple(written(point.settings[path]) for path in settings), []).append(point)
    lines = []
    for group in groups.values():
        own = {name: group[0].settings[path] for name, path in zip(names, settings, strict=True)}
        runs = [found[point.name] for point in group]
        label = ", ".join(f"{name} {written(value)}" for name, value in own.items()) or sweep.name
        lines.append(Line(label, own, len(runs), {name: _mean(runs, name) for name in metrics}))
    return lines


def _mean(runs: Sequence[Run], name: str) -> tuple[float, float]:
    """Mean of a `stage metric` and half its interval, or NaN; runs that share an artifact count as one measurement."""
    stage = name.partition(" ")[0]
    once = {run.artifacts[stage].manifest.key: _metric(run, name) for run in runs if stage in run.artifacts}
    values = np.array([value for value in once.values() if math.isfinite(value)], np.float64)
    if not len(values):
        return math.nan, math.nan
    alike = len(values) > 1 and not np.ptp(values)
    return float(values.mean()), 0.0 if alike else mean_half_width(values)


def _metric(run: Run, name: str) -> float:
    """The `stage metric` of a run; NaN where it has none."""
    stage, _, metric = name.partition(" ")
    return run.artifacts[stage].metrics.get(metric, math.nan) if stage in run.artifacts else math.nan


def _chosen(runs: Sequence[Run]) -> tuple[str, ...]:
    """Main metrics in which points differ, those of the last stages first; if none differs, those of the last stage."""
    found = (
        f"{stage} {name}"
        for stage in reversed(PIPELINE)
        for run in runs
        if stage in run.artifacts
        for name, _ in headline(stage, run.artifacts[stage].metrics)
    )
    known = list(dict.fromkeys(found))
    differing = [name for name in known if len({_metric(run, name) for run in runs}) > 1]
    last = [name for name in known if name.partition(" ")[0] == known[0].partition(" ")[0]]
    return tuple(reversed((differing or last)[:OUTCOMES_SHOWN]))


def write_results(
    sweep: Sweep, lines: Sequence[Line], found: Mapping[str, Run], states: Mapping[str, str], folder: Path
) -> list[Path]:
    """Write table and points; returns their paths."""
    paths = [folder / name for name in (SWEEP_TABLE, SWEEP_POINTS)]
    paths[0].write_text(markdown(table(sweep, lines)), encoding="utf-8")
    rows = []
    for point in sweep.points:
        row = {"point": point.name, "state": states.get(point.name, "waits"), **point.settings}
        for stage, artifact in found[point.name].artifacts.items() if point.name in found else ():
            row |= {f"{stage}/{name}": value for name, value in artifact.metrics.items()}
        rows.append(row)
    pd.DataFrame(rows).to_csv(paths[1], index=False)
    return paths


def table(sweep: Sweep, lines: Sequence[Line]) -> Table:
    """A row for each setting: means over seeds with half their 95 % interval."""
    rows = [
        (
            *map(written, line.settings.values()),
            str(line.runs),
            *(measured(mean, half, ".4g", ".2g", none="") for mean, half in line.figures.values()),
        )
        for line in lines
    ]
    caption = f"Sweep {sweep.name}: means over seeds with their 95 % interval."
    return Table(sweep.name, caption, heads(*lines[0].settings, "seeds", *lines[0].figures), rows, grouped=False)
