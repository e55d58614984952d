"""Stage rg-dataset: labels arm postures and base commands with support postures, and checks them in two ways."""

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from iowbc.errors import StageFailed
from iowbc.pipeline.stage import Job, Stage

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.spread import NodeSpread
    from iowbc.reference.labels.dataset import Shard
    from iowbc.reference.labels.pool import LabelTask

LABELLED = "labelled.npz"
"""Map of commands with labels; `feasible.npz` of rg-fit is its part without jumps of the network."""
CHUNK = {"static": 256, "ocp": 8}
"""Samples in a shard: one to three seconds of work, which is what an interruption or a crash costs."""
SHARES = 4
"""Pieces per core on other machines, so that cores idle for at most a quarter of the time at the end."""


def run(job: Job) -> None:
    """Leaves `dataset.npz`, `labelled.npz`, `summary.json` and figures."""
    import numpy as np

    from iowbc.errors import NoRenderer
    from iowbc.reference.labels.checks import chosen_for_crosscheck, compare_methods, mirror_error
    from iowbc.reference.labels.dataset import assemble, reasons
    from iowbc.reference.labels.plan import SamplePlan
    from iowbc.reference.labels.pool import LabelTask, label_all
    from iowbc.reference.pictures.figures import dataset_figures
    from iowbc.reference.pictures.postures import draw_strip
    from iowbc.reference.ranges import wrong_ranges
    from iowbc.reference.region import measure_labelled_region
    from iowbc.robot.description import load_robot

    recipe, seed = job.recipe.rg, job.recipe.seed
    robot = load_robot(job.robot)
    if wrong := [f"{path}: {text}" for path, text in wrong_ranges(robot, recipe)]:
        raise StageFailed("; ".join(wrong))
    plan = SamplePlan(robot, recipe, seed)

    def labelled(indices: Sequence[int], method: Literal["static", "ocp"], folder: str, note: str) -> "Shard":
        task, size, spread = LabelTask(job.robot, recipe, seed, method), CHUNK[method], job.spread
        return label_all(
            task,
            indices,
            folder=job.work / folder,
            key=job.key,
            chunk_size=size,
            workers=job.workers,
            interrupted=job.interrupted,
            progress=lambda done, total: job.report.progress(done, total, note),
            elsewhere=None if spread is None else partial(label_everywhere, spread, task, job.key, size),
        )

    began = time.monotonic()
    result = labelled(range(plan.count), recipe.method, "shards", f"{recipe.method} labels")
    seconds = time.monotonic() - began
    try:
        dataset = assemble(plan, result)
        region = measure_labelled_region(plan, dataset)
    except ValueError as error:
        raise StageFailed(str(error)) from error
    chosen = chosen_for_crosscheck(dataset, plan, recipe) if recipe.method == "static" else []
    check = None
    if chosen:
        job.report.say(f"checks {len(chosen)} labels against the optimal control problem")
        check = compare_methods(dataset, labelled(chosen, "ocp", "crosscheck", "optimal control"))

    metrics = {
        "samples": float(plan.count),
        "kept": float(len(dataset)),
        "kept_share": len(dataset) / plan.count,
        "margin_p1": float(np.percentile(dataset.margin, 1)),
        "torque_ratio_p99": float(np.percentile(abs(dataset.torque / robot.effort[robot.support]).max(axis=1), 99)),
    }
    if (symmetric := mirror_error(plan, dataset)) is not None:
        metrics |= {"mirror_pairs": float(len(symmetric)), "mirror_p99": float(np.percentile(symmetric, 99))}
    if check is not None:
        metrics |= check.metrics
    dataset.save(job.out / "dataset.npz")
    region.map.save(job.out / LABELLED)
    rejected = reasons(result)
    job.summarize(metrics, rejected=rejected, worst_crosscheck=[] if check is None else check.worst)
    job.report.metrics(metrics, 0)
    job.report.say(f"{len(dataset)} of {plan.count} samples have a label; labelling took {seconds:.0f} s here")
    figures = job.out / "figures"
    dataset_figures(figures, plan, dataset, region, rejected, check)
    try:
        draw_strip(figures / "postures.png", plan)
    except NoRenderer as error:
        job.report.say(f"no picture of postures: {error}")
    if chosen and check is None:
        raise StageFailed(
            f"optimal control labels none of the {len(chosen)} samples that check the static labels, so nothing says "
            "whether they are right. Check the weights in rg.problem, or set rg.crosscheck.samples to 0"
        )
    if check is not None and check.metrics["crosscheck_p90"] > recipe.crosscheck.p90_limit:
        raise StageFailed(
            f"static labels differ from optimal control by {check.metrics['crosscheck_p90']:.4f} rad "
            f"(p90 of {len(check.difference)} samples, the limit is {recipe.crosscheck.p90_limit} rad). "
            f"Worst: {'; '.join(check.worst)}. Check the weights in rg.problem, or label with `rg.method: ocp`"
        )


def label_everywhere(
    spread: "NodeSpread", task: "LabelTask", key: str, chunk_size: int, chunks: Sequence[Sequence[int]]
) -> Iterator[tuple[int, bytes]]:
    """Shards of chunks made on other machines, several per piece: place of the chunk, and content of the file."""
    size = max(1, len(chunks) // (SHARES * spread.width))
    shares = [range(start, min(start + size, len(chunks))) for start in range(0, len(chunks), size)]
    calls = [(task, [chunks[place] for place in share], key, chunk_size) for share in shares]
    for number, shards in spread(label_share, calls, {"robot": task.robot}):
        yield from zip(shares[number], shards, strict=True)


def label_share(
    task: "LabelTask", chunks: Sequence[Sequence[int]], key: str, chunk_size: int, *, robot: Path
) -> list[bytes]:
    """File contents of the shards of some chunks, made in a separate process, which a solver may crash."""
    from iowbc.reference.labels.pool import label_all

    with tempfile.TemporaryDirectory(prefix="iowbc-labels-") as folder:
        indices = [index for chunk in chunks for index in chunk]  # cut again they are equal: only the last is short
        label_all(replace(task, robot=robot), indices, folder=Path(folder), key=key, chunk_size=chunk_size)
        return [path.read_bytes() for path in sorted(Path(folder).glob("*.shard"))]


STAGE = Stage(
    name="rg-dataset",
    version=4,
    slice=(
        "seed",
        "rg.method",
        "rg.height",
        "rg.sampling",
        "rg.problem",
        "rg.ocp",
        "rg.gates",
        "rg.crosscheck",
        "rg.feasible",
    ),
    reads=lambda recipe: (),
    run=run,
    results=("dataset.npz", LABELLED),
    counts=("rg.sampling.samples",),
    headline=("samples", "kept", "crosscheck_p90"),
    pictures=("postures.png",),
    spreads=lambda recipe: True,
)
