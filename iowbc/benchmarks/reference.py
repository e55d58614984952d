"""`iowbc bench rg`: how fast support postures are labelled, by both methods, on one core and on several."""

import os
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from iowbc.recipe.recipe import Recipe
from iowbc.recipe.reference import ReferenceGenerator
from iowbc.reference.labelling import LabelTask
from iowbc.reference.labelling_pool import label_all
from iowbc.reference.sampling import SamplePlan
from iowbc.robot.description import load_robot, robot_folder


@dataclass(frozen=True)
class Course:
    """What one method labels in a measurement."""

    samples: int
    """Samples for each worker."""
    chunk: int
    """Samples in a shard: few, so that workers are busy until the end."""


COURSES = {"static": Course(2048, 32), "ocp": Course(64, 2)}


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
    cores = len(os.sched_getaffinity(0))
    counts = sorted(set(workers) or {1, 2, cores})
    plan = SamplePlan(load_robot(folder), recipe.rg, recipe.seed)
    say(f"{recipe.name}: {cores} cores, kept labels a second")
    say(f"{'method':10}{'workers':>10}{'labels/s':>12}{'a worker':>12}{'against 1':>12}{'kept':>8}")
    figures: dict[str, float] = {}
    for method in COURSES:
        rg = recipe.rg.model_copy(update={"method": method})
        measured = [[_rate(folder, rg, recipe.seed, plan.drawn, count) for count in counts] for _ in range(turns)]
        for place, count in enumerate(counts):
            rate, kept = max(turn[place] for turn in measured)
            figures[f"{method}_{count}"] = rate
            scaling = rate / figures[f"{method}_{counts[0]}"] * counts[0]
            figures[f"{method}_scaling_{count}"] = scaling
            say(f"{method:10}{count:>10}{rate:>12.1f}{rate / count:>12.1f}{scaling:>12.2f}{kept:>8.0%}")
    return figures


def _rate(robot: Path, rg: ReferenceGenerator, seed: int, drawn: int, workers: int) -> tuple[float, float]:
    """Kept labels a second, from the first finished shard to the last, and the share that was kept."""
    course = COURSES[rg.method]
    count = min(course.samples * workers, drawn)
    marks: list[tuple[float, int]] = []
    with tempfile.TemporaryDirectory(prefix="iowbc-bench-") as folder:
        result = label_all(
            LabelTask(robot, rg, seed, rg.method),
            range(count),
            folder=Path(folder),
            key="bench",
            chunk_size=course.chunk,
            workers=workers,
            interrupted=lambda: False,
            progress=lambda done, total: marks.append((time.perf_counter(), done)),
        )
    kept = len(result.kept) / count
    (begin, before), (end, after) = marks[workers], marks[-1]
    return kept * (after - before) / (end - begin), kept


if __name__ == "__main__":
    main()
