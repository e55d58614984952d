"""A request of `iowbc run` and `iowbc plan`, checked before anything heavy is imported."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path

from iowbc.errors import Problem, RecipeError, UsageError
from iowbc.files import folder_digest
from iowbc.pipeline.planner import Planner, Plans, planner_for
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe
from iowbc.recipe.reading.study import load_study
from iowbc.reference.ranges import wrong_ranges
from iowbc.robot.description import Robot, load_robot, robot_folder
from iowbc.stages.registry import STAGES


@dataclass(frozen=True)
class Request:
    """A call of `iowbc run`."""

    word: str
    """The recipe as it was named."""
    overrides: Sequence[str]
    runs: Runs
    options: Options
    verb: str = "run"
    """The command: `run` or `sweep`."""
    further: Sequence[str] = ()
    """Additional arguments of `iowbc sweep`."""

    def command(self, forced: Sequence[str] = ()) -> str:
        """The command that resumes this run; `forced`: stages that still have to be re-run."""
        words = ["iowbc", self.verb, self.word, *self.further]
        words += [word for override in self.overrides for word in ("--set", override)]
        for one in fields(Options):
            value = getattr(replace(self.options, force=frozenset(forced)), one.name)
            values = sorted(value) if isinstance(value, frozenset) else [] if value == one.default else [value]
            words += [word for each in values for word in (f"--{one.name.replace('_', '-')}", str(each))]
        return shlex.join([*words, *self.runs.option])


def planners(request: Request) -> list[Planner]:
    """The planner of a request's recipe, or of each variant of the study that it names. Raises `RecipeError`."""
    variants = load_study(request.word, request.overrides)
    if variants and request.options.force:
        files = ", ".join(str(variant.file) for variant in variants)
        text = f"names a stage of each variant, which they may share; force it in one of them: {files}"
        raise RecipeError([Problem(f"--force {min(request.options.force)}", text)])
    found = variants or (load_recipe(request.word, request.overrides),)
    return [prepared(loaded, request.runs, request.options) for loaded in found]


def prepared(loaded: LoadedRecipe, runs: Runs, options: Options) -> Planner:
    """The planner of a recipe. Raises `RecipeError`, also for what the robot does not have or cannot reach."""
    try:
        folder = robot_folder(loaded.recipe.robot)
    except UsageError as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot': {error}")]) from None
    try:
        robot = _robot(folder, folder_digest(folder))
    except (OSError, ValueError) as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot' = '{loaded.recipe.robot}': {error}")]) from None
    problems = [
        Problem(loaded.place(path), f"key '{path}': {text}") for path, text in wrong_ranges(robot, loaded.recipe.rg)
    ]
    if problems:
        raise RecipeError(problems)
    return planner_for(loaded, STAGES, Store(runs), folder, options)


def in_order(planner: Planner, known: Plans | None = None) -> list[Planner]:
    """Planners of a recipe's missing origins, in order, and its own; `known`: receives their plans."""
    known = {} if known is None else known
    if planner.origins:
        planner.plan(known)
    missing = [origin for origin in planner.origins.values() if not origin.plan(known)[-1].cached]
    return list(dict.fromkeys([*(each for origin in missing for each in in_order(origin, known)), planner]))


@cache
def _robot(folder: Path, digest: str) -> Robot:
    """The robot in a folder, read once while its files stay as they are."""
    return load_robot(folder)
