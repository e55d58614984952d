"""Games of `skill-eval`: all skills and baselines play the same episodes, some on controllers of other recipes."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pandas as pd
from pydantic import ValidationError

from iowbc.control.observation import observation_layout
from iowbc.errors import StageFailed
from iowbc.files import newest_checked, write_checked
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.skill.skill import Skill, SkillEvaluation
from iowbc.recipe.task.task import Task
from iowbc.robot.description import load_robot
from iowbc.skill.episodes import AGENT, Plan, Rule
from iowbc.skill.game import HUMAN, ROBOT, TransportGame, play_once
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

OF_CONTROLLER = ("control_frequency", "commands", "references", "action")
"""Parts of `task` that belong to a controller; the others belong to the games."""


@dataclass(frozen=True)
class Competitor:
    """A trained skill, or a scripted baseline."""

    label: str
    training: str
    """Distinguishes trainings with the same label."""
    rule: Rule | None
    robot: TeacherNetwork | None
    """The trained policy; None acts as the rule says."""
    controller: str = ""
    """Label of the controller below; empty for that of the recipe."""


def planned_games(skill: Skill, learnt_human: bool) -> list[Plan]:
    """All episodes of an evaluation. `learnt_human`: true if there is a trained human."""
    asked, kinds = skill.eval, skill.partners
    usual = (*kinds.training, *kinds.held_out, *([AGENT] if learnt_human else []))
    partners = dict.fromkeys(asked.partners or usual)
    tasks = {name: getattr(skill.tasks, name) for name in asked.tasks or skill.tasks.names}
    found = []
    for (name, task), known, partner in itertools.product(tasks.items(), asked.known, partners):
        if partner == "follower" and not known:
            continue  # a follower does not reveal the goal
        low, high = task.mass
        masses = asked.masses.get(task.scene) or [low + load * (high - low) for load in asked.loads]
        for mass, episode in itertools.product(dict.fromkeys(masses), range(asked.episodes)):
            found.append(Plan(name, partner, known, mass=mass, seed=asked.seed + episode))
    return found


def play_batches(
    settings: SkillEvaluation,
    competitor: Competitor,
    human: TeacherNetwork | None,
    planned: Sequence[Plan],
    controller: tuple[Specification, Student],
    workers: int,
    work: Path,
    interrupted: Callable[[], bool],
) -> Iterator[pd.DataFrame]:
    """Rows of a competitor's episodes, batch by batch; finished batches are kept in `work`. `human`: the learnt one;
    `controller`: the world and student below the competitor; `workers`: see `TransportGame`. Raises Interrupted, and
    StageFailed if the competitor observes another number of values than the games show."""
    for begin in range(0, len(planned), settings.games):
        batch = planned[begin : begin + settings.games]
        place = f"{competitor.label} {competitor.training} {begin} {len(batch)}"
        path = work / f"{quote(place, safe=' ')}.batch"
        content, _ = newest_checked(path, place)
        if content is None:
            plans = [replace(plan, rule=competitor.rule) for plan in batch]
            with closing(TransportGame(*controller, n=len(plans), workers=workers, plans=plans)) as game:
                size = game.observation_sizes[ROBOT]
                if competitor.robot is not None and (own := len(competitor.robot.normalizer.mean)) != size:
                    raise StageFailed(
                        f"skill.eval.others.{competitor.label}: that skill observes {own} numbers, this game shows "
                        f"{size}; train it with the same `skill` section and code"
                    )
                figures = play_once(game, {ROBOT: competitor.robot, HUMAN: human}, interrupted)
            rows = pd.DataFrame(figures).assign(
                label=competitor.label,
                training=competitor.training,
                episode=np.array([plan.seed for plan in batch]) - settings.seed,
                partner=[plan.partner for plan in batch],
                known=[plan.known for plan in batch],
            )
            content = rows.to_parquet(index=False)
            write_checked(path, place, content)
        yield pd.read_parquet(BytesIO(content))


def on_controller(world: Specification, label: str, own: Task, student: Student, rg: Path | None) -> Specification:
    """Specification of the same games with another controller. `label`: its name in `skill.eval.controllers`; `own`:
    the task for which its `student` was trained; `rg`: folder of its reference generator. Raises StageFailed if the
    controller has no grasp for a scene of the games, or observes more than they provide."""
    where, recipe = f"skill.eval.controllers.{label}", world.recipe
    shown = observation_layout(load_robot(world.robot), recipe.task.observation.observe_object).size
    if student.observation > shown:
        text = f"its student observes {student.observation} numbers, these games show {shown}"
        raise StageFailed(f"{where}: {text}; set task.observation.observe_object in the recipe of the games")
    task, scenes = own.model_dump(include=set(OF_CONTROLLER)), recipe.simulation.scenes.names
    for kind in ("grasps", "loads"):  # drop scenes that the games do not have
        entries = task["references"][kind].items()
        task["references"][kind] = {scene: entry for scene, entry in entries if scene in scenes}
    try:
        played = Recipe.model_validate(recipe.model_dump() | {"task": recipe.task.model_dump() | task})
    except ValidationError as error:
        reasons = "; ".join(problem["msg"] for problem in error.errors())
        text = f"{where}: cannot act in these games: {reasons}; leave it out, or train one whose recipe has this"
        raise StageFailed(text) from None
    return replace(world, recipe=played, rg=rg)
