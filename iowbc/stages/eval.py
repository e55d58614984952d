"""Stage `eval`: mass sweeps, heavy cases and a probe of the trained policy, their tables, figures and films."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.results.table import write_frame
from iowbc.stages.inputs import generator_stage, leaves_student, policy_stage

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.evaluation.trials.plan import Trial
    from iowbc.evaluation.trials.protocol import Batches
    from iowbc.learning.acting import Policy
    from iowbc.pipeline.cluster.spread import NodeSpread
    from iowbc.task.specification import Specification


FORCES = ("handle_force_p95", "hand_force_p95")
"""Force metrics shown for compliance trials."""


def acting_stage(recipe: Recipe) -> tuple[str, ...]:
    """The stage whose artifact holds the policy to evaluate; none for what this project did not train."""
    stages = {"student": (policy_stage(recipe),), "teacher": ("teacher",)}
    return stages.get(recipe.eval.policy, ())


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """Problems: a student that no stage trains, and settings that do not fit an external controller."""
    if recipe.eval.policy == "student" and not leaves_student(recipe):
        text = "asks for the student, and no stage of the recipe trains one: add `distill` to its stages, or evaluate "
        yield "eval.policy", f"{text}the teacher with --set eval.policy=teacher"
    if (recipe.eval.policy == "public") != (recipe.eval.public is not None):
        yield "eval.public", "belongs to eval.policy 'public', which needs it"
    if recipe.eval.policy in ("model", "public") and recipe.eval.probe is not None:
        yield "eval.probe", "reads what a trained policy knows of its load: leave it out, or evaluate the student"


def defaults(recipe: Recipe) -> dict[str, object]:
    """The command sequences of sweeps and cases that have none in the recipe, and the length of the history in which
    the load of a policy without one is probed."""
    found: dict[str, object] = {}
    if not recipe.eval.sequence:
        for name, sequence in (("lifting", LIFTING), ("pushing", PUSHING)):
            found[f"defaults.{name}_sequence"] = [deciding(segment) for segment in sequence]
    if recipe.eval.probe is not None and recipe.eval.policy == "teacher" and recipe.teacher.history is None:
        found["distill.history"] = recipe.distill.history
    return found


def run(job: Job) -> None:
    """Play all trials; leave `trials.parquet`, `probe.parquet`, tables, figures, films and a summary."""
    recipe, metrics = job.recipe, dict[str, float]()
    world, policy = world_and_policy(recipe, **read_by_trials(job))
    try:
        if recipe.eval.measured:
            metrics |= measure(job, world, policy)
        if recipe.eval.probe is not None:
            metrics |= probe(job, world, policy)
    except Interrupted as stopped:
        raise Interrupted(f"eval: {stopped}; finished batches are kept") from stopped
    job.report.metrics(metrics, 0)
    job.summarize(metrics)


def measure(job: Job, world: "Specification", policy: "Policy") -> dict[str, float]:
    """Play the trials whose errors are measured, report and film them; the figures to show at the end of a run."""
    from iowbc.errors import NoRenderer
    from iowbc.evaluation.films import film_trial, filmed, written_film
    from iowbc.evaluation.report.limits import PROBING
    from iowbc.evaluation.report.report import write_report
    from iowbc.evaluation.trials.protocol import Protocol

    recipe = job.recipe
    protocol = Protocol(
        world,
        policy,
        work=job.work,
        workers=job.workers,
        interrupted=job.interrupted,
        progress=job.report.progress,
        elsewhere=None if job.spread is None else partial(play_everywhere, job.spread, recipe, read_by_trials(job)),
    )
    trials = protocol.run()
    write_frame(trials, job.out / "trials.parquet")
    summary = write_report(trials, job.out, recipe.eval.success.capacity_rate)
    (job.out / "videos").mkdir()
    try:
        for name, row in filmed(trials, recipe.eval.video.count):
            job.report.progress(len(trials), len(trials), f"film {name}")
            with written_film(job.out / "videos" / f"{name}.mp4", recipe.eval.video.fps) as add:
                film_trial(world, policy, row, add, recipe.eval.video, job.interrupted)
    except NoRenderer as reason:
        job.report.say(f"no films: {reason}")
    for suite, rows in summary[~summary["kind"].isin(PROBING)].groupby("suite", sort=False):
        counts = ", ".join(f"{_load(row)} {row['succeeded']}/{row['trials']}" for _, row in rows.iterrows())
        job.report.say(f"{suite}: succeeded {counts}")
    return headline(summary)


def probe(job: Job, world: "Specification", policy: "Policy") -> dict[str, float]:
    """Regress the object's mass on the policy's inputs and write the report; returns R² and RMSE of each source."""
    from iowbc.evaluation.probe import inferred_masses, read
    from iowbc.evaluation.report.probe import write_probe

    asked = job.recipe.eval.probe
    assert asked is not None
    duration = sum(segment.duration for segment in asked.sequence)

    def progress(seconds: float) -> None:
        job.report.progress(min(seconds, duration), duration, f"probe, {asked.trials} trials")

    readings = read(world, policy, workers=job.workers, interrupted=job.interrupted, progress=progress)
    inferred = inferred_masses(*readings).assign(
        variant=job.recipe.eval.label, scene=asked.scene, partner_share=asked.partner_share
    )
    inferred.to_parquet(job.out / "probe.parquet", index=False)
    figures = write_probe(inferred, job.out)
    for _, row in figures.iterrows():
        job.report.say(f"probe: mass from {row['source']}: R² {row['R2']:.3f}, {row['RMSE']:.2f} kg")
    names = {"R2": "R2", "R2_trial": "R2_of_a_trial", "RMSE": "RMSE_kg"}
    return {
        f"probe/{row['source'].replace(' ', '_')}/{metric}": float(row[name])
        for _, row in figures.iterrows()
        for name, metric in names.items()
    }


def read_by_trials(job: Job) -> dict[str, Path]:
    """Folders from which a batch of trials can be played on another machine; see `play_batch`."""
    read = [("generator", "rg-fit"), *(("policy", stage) for stage in acting_stage(job.recipe))]
    return {"robot": job.robot} | {name: job.inputs[stage] for name, stage in read if stage in job.inputs}


def play_everywhere(
    spread: "NodeSpread", recipe: Recipe, folders: Mapping[str, Path], batches: "Batches"
) -> "Iterator[tuple[str, bytes]]":
    """Play batches of trials on other machines; name and content of each file. `folders`: inputs of `play_batch`."""
    names = list(batches)
    for place, content in spread(play_batch, [(recipe, batches[name]) for name in names], folders):
        yield names[place], content


def play_batch(recipe: Recipe, trials: "Sequence[Trial]", **folders: Path) -> bytes:
    """Play one batch; its file."""
    from iowbc.evaluation.trials.protocol import played

    return played(*world_and_policy(recipe, **folders), trials, workers=0)


def world_and_policy(
    recipe: Recipe, *, robot: Path, policy: Path | None = None, generator: Path | None = None
) -> "tuple[Specification, Policy]":
    """The world of the trials and the policy that acts in it; from now on torch uses one thread."""
    import torch

    from iowbc.evaluation.trials.protocol import evaluated_policy, evaluated_world
    from iowbc.task.specification import Specification

    torch.set_num_threads(1)  # the result must not depend on the machine's cores, and the policy is small
    world = evaluated_world(Specification(recipe, robot, generator))
    return world, evaluated_policy(world, policy)


def headline(summary: "pd.DataFrame") -> dict[str, float]:
    """Success and errors of each case and at each suite's lightest and heaviest mass; forces of compliance trials."""
    from iowbc.evaluation.report.aggregate import case_names
    from iowbc.evaluation.report.limits import PROBING
    from iowbc.evaluation.trials.errors import ERRORS

    metrics = {name: float(summary[name].sum()) for name in ("trials", "survived", "succeeded")}
    shown = summary[~summary["kind"].isin(PROBING)]
    for _, row in shown.assign(named=case_names(shown)).iterrows():
        rows = summary[summary["suite"] == row["suite"]]
        if row["case"] == row["suite"] and row["mass"] not in (rows["mass"].min(), rows["mass"].max()):
            continue
        name = f"{row['named']}/{row['mass']:g}kg".replace(" ", "_").replace("%", "percent")
        metrics[f"{name}/success"] = float(row["rate"])
        if not math.isnan(row["transport_robot"]):
            metrics[f"{name}/transport"] = float(row["transport_robot"])
        if row["survived"]:
            metrics |= {f"{name}/{error}": float(row[error]) for error in ERRORS}
        forces = FORCES if row["kind"] == "compliance" else ()
        metrics |= {f"{name}/{force}": float(row[force]) for force in forces if not math.isnan(row[force])}
    return metrics


def _load(row: "pd.Series[Any]") -> str:
    """Text of mass and, if different from the suite, case."""
    mass = f"{row['mass']:g} kg"
    return mass if row["case"] == row["suite"] else f"{row['case']} ({mass})"


STAGE = Stage(
    name="eval",
    version=7,
    slice=("rg.height", "simulation", "task", "eval"),
    reads=lambda recipe: (*generator_stage(recipe), *acting_stage(recipe)),
    run=run,
    problems=problems,
    defaults=defaults,
    results=("*.parquet",),
    counts=("eval.trials",),
    headline=("trials", "survived", "succeeded"),
    columns=("succeeded", "trials"),
    pictures=("comparison.png", "compliance.png", "push_map.png"),
    spreads=lambda recipe: True,
)
