"""`iowbc bench rg`: rate of labelling support postures, by both methods, on one core and on several."""

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import psutil

from iowbc.processes import available_cores
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.recipe import Recipe
from iowbc.reference.labels.labelling import LabelTask
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.pool import label_all
from iowbc.robot.description import load_robot, robot_folder

SAMPLES = {"static": (2048, 32), "ocp": (64, 2)}
"""Samples per worker by method, and samples per shard: few, so that workers are busy until the end."""


def main(recipe: Recipe, *, workers: Sequence[int] = (), turns: int = 3) -> dict[str, float]:
    """Measures, prints the table, returns every rate by name (kept labels a second).

    `workers`: counts to measure, by default 1, 2 and the number of cores. All counts are measured `turns` times,
    alternately; the best repetition counts, as the least disturbed one. The start of the processes is left out. Rates
    "a core" are per CPU time: the rate of a core that no other program uses.
    """
    folder = robot_folder(recipe.robot)
    cores = available_cores()
    counts = sorted(set(workers) or {1, 2, cores})
    drawn = SamplePlan(load_robot(folder), recipe.rg, recipe.seed).drawn
    print(f"{recipe.name}: {cores} cores, kept labels a second")
    print(f"{'method':10}{'workers':>10}{'labels/s':>12}{'a core':>12}{'scaling':>12}{'kept':>8}")
    figures: dict[str, float] = {}
    for method in SAMPLES:
        rg = recipe.rg.model_copy(update={"method": method})
        measured = np.array([[_pace(folder, rg, recipe.seed, drawn, count) for count in counts] for _ in range(turns)])
        for count, (rate, a_core, kept) in zip(counts, measured.max(axis=0).tolist(), strict=True):
            figures |= {f"{method}_{count}": rate, f"{method}_a_core_{count}": a_core}
            scaling = figures[f"{method}_scaling_{count}"] = counts[0] * rate / figures[f"{method}_{counts[0]}"]
            print(f"{method:10}{count:>10}{rate:>12.1f}{a_core:>12.1f}{scaling:>12.2f}{kept:>8.0%}")
    return figures


def _pace(robot: Path, rg: ReferenceGenerator, seed: int, drawn: int, workers: int) -> tuple[float, float, float]:
    """Kept labels per second and per second of CPU time, from the first finished shard of each worker to the last of
    all; fraction of the samples that were kept."""
    samples, chunk = SAMPLES[rg.method]
    count = min(samples * workers, drawn)
    marks: list[tuple[int, float, float]] = []

    def mark(done: int, total: int) -> None:
        used = [child.cpu_times() for child in psutil.Process().children()]
        marks.append((done, time.perf_counter(), sum(one.user + one.system for one in used)))

    with tempfile.TemporaryDirectory(prefix="iowbc-bench-") as folder:
        result = label_all(
            LabelTask(robot, rg, seed, rg.method),
            range(count),
            folder=Path(folder),
            key="bench",
            chunk_size=chunk,
            workers=workers,
            interrupted=lambda: False,
            progress=mark,
        )
    kept = len(result.kept) / count
    done, seconds, used = np.subtract(marks[-1], marks[workers])
    return float(kept * done / seconds), float(kept * done / used), kept
