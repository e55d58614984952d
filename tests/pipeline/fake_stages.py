"""A pipeline of small stages that count instead of learn, and `main`: the command line on top of it.

`FAKE_BEHAVIOUR` (JSON by stage name) makes stages slow or faulty: `steps`, `pause` [s], `gate` (a file without which
none goes on after its first step), `fail` (StageFailed), `lose` (WorkerFailed), `raise`, `pieces` (for
others to count, too); with `seed` those of recipes with that seed alone.
With `FAKE_SENDER=off` nothing is sent to MLflow yet.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from iowbc.errors import Interrupted, StageFailed, WorkerFailed
from iowbc.files import newest_checked, write_checked
from iowbc.pipeline import stage as contract
from iowbc.pipeline.stage import Job, Stage
from iowbc.pipeline.tracking import tracker as tracking
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import DESCRIPTION
from iowbc.stages import registry as real

CHECKPOINT = "checkpoint.one"
STARTED = "started_at.json"
"""Record of how far the checkpoint was from which a stage went on."""


def doubled(number: int, *, robot: Path) -> int:
    """A piece of a stage, for any machine that has the robot; the last of four is slow."""
    assert (robot / DESCRIPTION).is_file()
    time.sleep(3.0 if number == 3 else 0.02)
    return 2 * number


def counting(name: str) -> Callable[[Job], None]:
    """A stage that counts to `steps` with a checkpoint after each, and writes what its key says it depends on."""

    def run(job: Job) -> None:
        behaviour = json.loads(os.environ.get("FAKE_BEHAVIOUR", "{}")).get(name, {})
        if behaviour.get("seed", job.recipe.seed) != job.recipe.seed:
            behaviour = {}
        content, _ = newest_checked(job.work / CHECKPOINT, job.key)
        done = json.loads(content) if content is not None else 0
        started_at = done
        steps = behaviour.get("steps", 3)
        while done < steps:
            time.sleep(behaviour.get("pause", 0.0))
            if done and not os.path.exists(behaviour.get("gate", "/")):
                if job.interrupted():
                    raise Interrupted(f"{name}: stopped at {done} of {steps}, checkpoint written")
                continue
            done += 1
            write_checked(job.work / CHECKPOINT, job.key, json.dumps(done).encode(), keep_previous=True)
            job.report.metrics({"count": float(done), "half": done / 2}, done)
            job.report.progress(done, steps, f"at {done}")
            if job.interrupted():
                raise Interrupted(f"{name}: stopped at {done} of {steps}, checkpoint written")
        if behaviour.get("fail"):
            raise StageFailed(behaviour["fail"])
        if behaviour.get("lose"):
            raise WorkerFailed(behaviour["lose"])
        if behaviour.get("raise"):
            raise RuntimeError(behaviour["raise"])
        for folder in ("tables", "figures"):
            (job.out / folder).mkdir()
        (job.out / "tables" / "counts.md").write_text(f"| {name} |\n|---|\n| {done} |\n")
        (job.out / "figures" / "curve.png").write_bytes(b"not really a picture")
        (job.out / "result.json").write_text(json.dumps({"seed": job.recipe.seed, "count": done}))
        if job.spread is not None:
            calls = [(number,) for number in range(behaviour.get("pieces", 0))]
            assert sorted(job.spread(doubled, calls, {"robot": job.robot})) == [(n, 2 * n) for n in range(len(calls))]
        (job.out / STARTED).write_text(json.dumps(started_at))
        job.summarize({"count": float(done)}, note=behaviour.get("note", ""))

    return run


def stage(
    name: str,
    reads: tuple[str, ...],
    slice: tuple[str, ...],
    counts: tuple[str, ...] = (),
) -> Stage:
    """A counting stage that reads the others that its recipe has."""

    def known(recipe: Recipe) -> tuple[str, ...]:
        return tuple(read for read in reads if read in recipe.stages)

    own = real.STAGES[name]
    return Stage(
        name,
        1,
        slice,
        reads=known,
        run=counting(name),
        results=("result.json",),
        counts=counts,
        borrows=own.borrows,
        headline=own.headline,
        columns=own.columns,
        pictures=own.pictures,
        curves=own.curves,
        trained_by=own.trained_by,
        leaves_policy=own.leaves_policy,
    )


STAGES = {
    made.name: made
    for made in (
        stage("rg-dataset", (), ("seed", "rg")),
        stage("rg-fit", ("rg-dataset",), ("seed", "rg")),
        stage("teacher", ("rg-fit",), ("seed", "simulation", "task", "teacher"), ("teacher.steps",)),
        stage("distill", ("rg-fit", "teacher"), ("distill",)),
        stage("eval", ("distill",), ("eval",), counts=("eval.trials",)),
        stage("export", ("distill",), ("name", "export")),
    )
}


def main() -> None:
    """The command line, on these stages."""
    from types import ModuleType

    registry = ModuleType("iowbc.stages.registry")
    registry.STAGES = STAGES  # type: ignore[attr-defined]
    sys.modules["iowbc.stages.registry"] = registry
    sys.modules[contract.__package__].registry = registry  # type: ignore[attr-defined, index]

    if os.environ.get("FAKE_SENDER") == "off":
        tracking.start_sender = lambda runs: subprocess.Popen(["true"])

    from iowbc.cli import main as command

    command()


if __name__ == "__main__":
    main()
