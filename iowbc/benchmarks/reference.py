"""`iowbc bench rg`: how fast support postures are labelled, by both methods, on one core and on several."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Course:
    """What one method labels in a measurement."""

    samples: int
    """Samples for each worker."""
    chunk: int
    """Samples in a shard: few, so that workers are busy until the end."""


COURSES = {"static": Course(2048, 32), "ocp": Course(64, 2)}


@dataclass(frozen=True)
class Pace:
    """How fast a measurement went."""

    rate: float
    """Kept labels a second."""
    a_core: float
    """Kept labels a second of processor time: what a core gives that is not shared with other programs."""
    kept: float
    """Share of the samples that were kept."""


def main(
    recipe: Recipe | None = None,
    robot: Path | None = None,
    *,
    workers: Sequence[int] = (),
    turns: int = 3,
    say: Callable[[str], None] = print,
) -> dict[str, float]:
    """Measures, prints the table, returns every figure by name (rates in kept labels a second).

    `workers`: counts to measure, by default 1, 2 and the number of cores. All counts take turns, and the best turn of
    each counts: the one that other programs disturbed least. The start of the processes is left out.
    """
    recipe = recipe or Recipe(name="bench")
    folder = robot or robot_folder(recipe.robot)
    cores = available_cores()
    counts = sorted(set(workers) or {1, 2, cores})
    plan = SamplePlan(load_robot(folder), recipe.rg, recipe.seed)
    say(f"{recipe.name}: {cores} cores, kept labels a second")
    say(f"{'method':10}{'workers':>10}{'labels/s':>12}{'a core':>12}{'scaling':>12}{'kept':>8}")
    figures: dict[str, float] = {}
    for method in COURSES:
        rg = recipe.rg.model_copy(update={"method": method})
        measured = [[_pace(folder, rg, recipe.seed, plan.drawn, count) for count in counts] for _ in range(turns)]
        for place, count in enumerate(counts):
            best = max((turn[place] for turn in measured), key=lambda pace: pace.rate)
            a_core = max(turn[place].a_core for turn in measured)
            figures |= {f"{method}_{count}": best.rate, f"{method}_a_core_{count}": a_core}
            scaling = counts[0] * best.rate / figures[f"{method}_{counts[0]}"]
            figures[f"{method}_scaling_{count}"] = scaling
            say(f"{method:10}{count:>10}{best.rate:>12.1f}{a_core:>12.1f}{scaling:>12.2f}{best.kept:>8.0%}")
    return figures


def _pace(robot: Path, rg: ReferenceGenerator, seed: int, drawn: int, workers: int) -> Pace:
    """Labels from the first finished shard of each worker to the last of all."""
    course = COURSES[rg.method]
    count = min(course.samples * workers, drawn)
    marks: list[tuple[int, float, float]] = []

    def mark(done: int, total: int) -> None:
        marks.append((done, time.perf_counter(), _processor_time()))

    with tempfile.TemporaryDirectory(prefix="iowbc-bench-") as folder:
        result = label_all(
            LabelTask(robot, rg, seed, rg.method),
            range(count),
            folder=Path(folder),
            key="bench",
            chunk_size=course.chunk,
            workers=workers,
            interrupted=lambda: False,
            progress=mark,
        )
    kept = len(result.kept) / count
    done, seconds, used = np.subtract(marks[-1], marks[workers])
    return Pace(float(kept * done / seconds), float(kept * done / used), kept)


def _processor_time() -> float:
    """Processor time of this process's children so far [s]."""
    times = [child.cpu_times() for child in psutil.Process().children()]
    return float(sum(used.user + used.system for used in times))


if __name__ == "__main__":
    main()
