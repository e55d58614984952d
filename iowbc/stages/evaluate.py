"""Stage `eval`: mass sweeps and heavy cases with the trained policy, their tables, figures and films."""

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.recipe import Recipe
from iowbc.stages.inputs import ENVIRONMENTS, generator_stage, leaves_student, policy_stage
from iowbc.stages.spreading import play_everywhere

if TYPE_CHECKING:
    import pandas as pd


def acting_stage(recipe: Recipe) -> str:
    """The stage whose artifact holds the policy to evaluate."""
    return policy_stage(recipe) if recipe.eval.policy == "student" else "teacher"


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """A student that no stage leaves."""
    if recipe.eval.policy == "student" and not leaves_student(recipe):
        text = "asks for the student, and no stage of the recipe trains one: add `distill` to its stages, or evaluate "
        yield "eval.policy", f"{text}the teacher with --set eval.policy=teacher"


def run(job: Job) -> None:
    """Play all trials; leave `trials.parquet`, tables, figures, films and a summary."""
    import torch

    from iowbc.errors import NoRenderer
    from iowbc.evaluation.films import Film, film_trial, filmed
    from iowbc.evaluation.report.report import write_report
    from iowbc.evaluation.trials.protocol import Protocol, evaluated_world
    from iowbc.learning.acting import load_policy
    from iowbc.task.specification import Specification

    torch.set_num_threads(1)  # the result must not depend on the machine's cores, and the policy is small
    recipe = job.recipe
    policy = load_policy(job.inputs[acting_stage(recipe)])
    world = evaluated_world(Specification(recipe, job.robot, job.inputs.get("rg-fit")))
    protocol = Protocol(
        world,
        policy,
        work=job.work,
        workers=job.workers,
        interrupted=job.interrupted,
        progress=job.report.progress,
        elsewhere=None if job.spread is None else partial(play_everywhere, job.spread, recipe, read_by_trials(job)),
    )
    try:
        trials = protocol.run()
        trials.to_parquet(job.out / "trials.parquet", index=False)
        summary = write_report(trials, job.out, recipe.eval.success.capacity_rate)
        (job.out / "videos").mkdir()
        for name, row in filmed(trials, recipe.eval.video.count):
            job.report.progress(len(trials), len(trials), f"film {name}")
            film = Film(job.out / "videos" / f"{name}.mp4", recipe.eval.video.fps)
            film_trial(world, policy, row, film, recipe.eval.video, job.interrupted)
    except NoRenderer as reason:
        job.report.say(f"no films: {reason}")
    except Interrupted as stopped:
        raise Interrupted(f"eval: {stopped}; finished batches are kept") from stopped
    metrics = headline(summary)
    job.report.metrics(metrics, 0)
    job.summarize(metrics)
    for suite, rows in summary[summary["kind"] != "pushes"].groupby("suite", sort=False):
        counts = ", ".join(f"{_load(row)} {row['succeeded']}/{row['trials']}" for _, row in rows.iterrows())
        job.report.say(f"{suite}: succeeded {counts}")


def read_by_trials(job: Job) -> dict[str, Path]:
    """Folders from which a batch of trials can be played on another machine; see `play_batch`."""
    generator = {"generator": job.inputs["rg-fit"]} if "rg-fit" in job.inputs else {}
    return {"robot": job.robot, "policy": job.inputs[acting_stage(job.recipe)], **generator}


def headline(summary: "pd.DataFrame") -> dict[str, float]:
    """The figures to show at the end of a run: success and errors at the lightest and heaviest mass of each suite."""
    from iowbc.evaluation.trials.errors import ERRORS

    metrics = {name: float(summary[name].sum()) for name in ("trials", "survived", "succeeded")}
    for _, row in summary[summary["kind"] != "pushes"].iterrows():
        rows = summary[summary["suite"] == row["suite"]]
        if row["case"] == row["suite"] and row["mass"] not in (rows["mass"].min(), rows["mass"].max()):
            continue
        name = f"{row['case']}/{row['mass']:g}kg".replace(" ", "_").replace("%", "percent")
        metrics[f"{name}/success"] = float(row["rate"])
        if not math.isnan(row["transport_robot"]):
            metrics[f"{name}/transport"] = float(row["transport_robot"])
        if row["survived"]:
            metrics |= {f"{name}/{error}": float(row[error]) for error in ERRORS}
    return metrics


def _load(row: "pd.Series[Any]") -> str:
    """The case, where it has a name of its own, and the mass."""
    mass = f"{row['mass']:g} kg"
    return mass if row["case"] == row["suite"] else f"{row['case']} ({mass})"


STAGE = Stage(
    name="eval",
    version=3,
    slice=("rg.height", "simulation", "task", "eval"),
    reads=lambda recipe: (*generator_stage(recipe), acting_stage(recipe)),
    run=run,
    problems=problems,
    results=("trials.parquet",),
    packages=("stages.evaluate", "evaluation", "deploy", "learning", *ENVIRONMENTS),
    counts=("eval.trials",),
    spreads=True,
)
