"""Stage `skill-eval`: trained skills and rivals play the same games; tables and a figure compare them."""

from collections.abc import Iterator, Mapping

from iowbc.errors import StageFailed
from iowbc.pipeline.stage import ExternalInput, Job, Stage
from iowbc.recipe.recipe import Recipe
from iowbc.results.table import write_frame
from iowbc.stages.inputs import generator_stage, policy_stage, without_student
from iowbc.stages.skill import GAME

RIVALS = {
    "nominal": "nominal",
    "lead": "scripted leader",
    "follow": "admittance follower",
    "clock": "by the clock",
    "stand": "standing",
}
"""Labels of the rules that play without a skill."""


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """Problems: no trained student or skill, or unknown tasks or scenes."""
    asked = recipe.skill.eval
    yield from without_student(recipe, "skill-eval")
    if "skill" not in recipe.stages and "agent" in asked.partners:
        yield "skill.eval.partners", "agent: no stage of the recipe trains a human; add `skill` to its stages"
    if "skill" not in recipe.stages and asked.controllers:
        yield "skill.eval.controllers", "no stage of the recipe trains a skill; add `skill` to its stages"
    if {*asked.partners} == {"follower"} and True not in asked.known:
        yield "skill.eval", "a follower plays only where the goal is known: add true to `known`, or another partner"
    tasks = {name: getattr(recipe.skill.tasks, name) for name in recipe.skill.tasks.names}
    for name in asked.tasks:
        if name not in tasks:
            yield "skill.eval.tasks", f"no task {name!r}; valid: {', '.join(tasks)}"
    for rule in asked.rivals:
        if RIVALS[rule] in (asked.label, *asked.others):
            yield "skill.eval", f"the label {RIVALS[rule]!r} is that of the rule `{rule}`; choose another"
    scenes = dict.fromkeys(task.scene for name, task in tasks.items() if name in (asked.tasks or tasks))
    for scene in asked.masses:
        if scene not in scenes:
            yield f"skill.eval.masses.{scene}", f"no task of the evaluation has this scene; valid: {', '.join(scenes)}"


def borrows(recipe: Recipe) -> Mapping[str, ExternalInput]:
    """Skills that other recipes train, and controllers with their reference generators."""
    skills = {
        f"{label}/{place}": ExternalInput(f"skill.eval.others.{label}", named, "skill")
        for label, several in recipe.skill.eval.others.items()
        for place, named in enumerate(several)
    }
    return skills | {
        f"{label}/{stage}": ExternalInput(f"skill.eval.controllers.{label}", named, stage)
        for label, named in recipe.skill.eval.controllers.items()
        for stage in ("rg-fit", "distill")
    }


def run(job: Job) -> None:
    """Play all games; leave `games.parquet`, tables, a figure and a summary."""
    import pandas as pd
    import torch

    from iowbc.learning.storage import load_teacher
    from iowbc.pipeline.store.artifact import RECIPE
    from iowbc.pipeline.store.runs import read_yaml
    from iowbc.results.picture import write_figure
    from iowbc.results.table import write_table
    from iowbc.skill.evaluation.games import Competitor, on_controller, planned_games, play_batches
    from iowbc.skill.evaluation.tables import figure, headline, tables
    from iowbc.skill.lower_layer import load_student
    from iowbc.task.specification import Specification

    torch.set_num_threads(1)  # the result must not depend on the machine's cores
    recipe, skill, asked = job.recipe, job.recipe.skill, job.recipe.skill.eval
    world = Specification(recipe, job.robot, job.inputs.get("rg-fit")).deployed
    student = load_student(job.inputs[policy_stage(recipe)], world)
    human = load_teacher(job.inputs["skill"], "human")[0] if "skill" in job.inputs else None
    lower = {"": (world, student)}
    for label in asked.controllers:
        folder, rg = job.inputs[f"{label}/distill"], job.inputs[f"{label}/rg-fit"]
        task, other = Recipe.model_validate(read_yaml(folder / RECIPE)).task, load_student(folder)
        lower[label] = on_controller(world, label, task, other, rg), other
    skills = [(asked.label, "own", "skill", "")] if "skill" in job.inputs else []
    for label, several in asked.others.items():
        for place, named in enumerate(several):
            made = Recipe.model_validate(read_yaml(job.inputs[f"{label}/{place}"] / RECIPE)).skill
            if (made.robot, made.frequency) != (skill.robot, skill.frequency):
                text = "its skill.robot or skill.frequency is another, and its actions mean something else here"
                raise StageFailed(f"skill.eval.others.{label}.{place}: {named}: {text}")
            skills.append((label, str(place), f"{label}/{place}", ""))
    skills += [(f"{asked.label} on {label}", "own", "skill", label) for label in asked.controllers]
    competing = [
        Competitor(label, training, None, load_teacher(job.inputs[name], "robot")[0], controller)
        for label, training, name, controller in skills
    ]
    competing += [Competitor(RIVALS[rule], "", None if rule == "nominal" else rule, None) for rule in asked.rivals]
    planned = planned_games(skill, human is not None)
    rows: list[pd.DataFrame] = []
    done = 0
    for competitor in competing:
        game = (asked, competitor, human, planned, lower[competitor.controller])
        for batch in play_batches(*game, job.workers, job.work, job.interrupted):
            rows.append(batch)
            done += len(batch)
            job.report.progress(done, len(planned) * len(competing), f"{competitor.label} {competitor.training}")
    games = pd.concat(rows, ignore_index=True)
    write_frame(games, job.out / "games.parquet")
    for table in tables(games, skill.partners.held_out):
        write_table(table, job.out / "tables")
    write_figure(figure(games), job.out / "figures" / "skill_partners.png")
    metrics = headline(games)
    job.report.metrics(metrics, 0)
    job.summarize(metrics | {"games": float(len(games))})


STAGE = Stage(
    name="skill-eval",
    version=1,
    slice=("rg.height", "simulation", "task", *GAME, "skill.partners.held_out", "skill.eval"),
    reads=lambda recipe: (
        *generator_stage(recipe),
        policy_stage(recipe),
        *(("skill",) if "skill" in recipe.stages else ()),
    ),
    run=run,
    problems=problems,
    results=("games.parquet",),
    borrows=borrows,
    headline=("games", "*/human_only/partner_force_p90", "*/human_only/success"),
    columns=("games",),
    pictures=("skill_partners.png",),
)
