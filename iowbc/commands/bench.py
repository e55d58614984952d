"""`iowbc bench`: benchmarks of this machine and of two physics engines."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from iowbc.commands import options
from iowbc.errors import IowbcError, require_known
from iowbc.pipeline.store.runs import Runs, require_writable_runs
from iowbc.pipeline.tracking.tracker import record_figures
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder

BenchRecipe = Annotated[Path | None, typer.Argument(help="Recipe file (default: built-in values).", metavar="RECIPE")]


def sim(
    recipe: BenchRecipe = None,
    scene: options.SceneName = "lift",
    environments: Annotated[int, typer.Option(help="Environments per worker.", min=1)] = 48,
    workers: Annotated[list[int] | None, typer.Option(help="Worker processes (repeatable).", min=1)] = None,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Measure the vector environment. Raises `UsageError`."""
    own, counts = _checked(runs, recipe, scene), tuple(workers or ())
    from iowbc.benchmarks import simulation

    figures = simulation.main(own, scene=scene, environments=environments, workers=counts)
    record_figures(Runs(runs), "bench-sim", figures)


def train(
    recipe: BenchRecipe = None,
    scene: options.SceneName = "lift",
    turns: Annotated[int, typer.Option(help="Number of updates.", min=1)] = 6,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Measure the teacher's training. Raises `UsageError`."""
    own = _checked(runs, recipe, scene)
    from iowbc.benchmarks import training

    record_figures(Runs(runs), "bench-train", training.main(own, scene=scene, turns=turns))


def control(
    what: options.Exported,
    steps: Annotated[int, typer.Option(help="Number of control steps.", min=1)] = 5000,
    skill: Annotated[Path | None, typer.Option(help="Folder of a skill that commands the controller.")] = None,
) -> None:
    """Measure the control step's time of an exported controller, and print it in quantiles."""
    from iowbc.deploy.timing import step_seconds

    print(f"{what}: {steps:,} control steps of one robot on one thread")
    print(f"{'':16}{'median':>12}{'99th percentile':>18}{'longest':>12}")
    for name, taken in zip(("time", "processor time"), 1e3 * step_seconds(what, steps, skill).T, strict=True):
        median, late, longest = (f"{value:.3f} ms" for value in np.quantile(taken, (0.5, 0.99, 1.0)))
        print(f"{name:16}{median:>12}{late:>18}{longest:>12}")


def engines(robot: Annotated[str, typer.Argument(help="Robot, by name or folder.", metavar="ROBOT")] = "g1") -> None:
    """Compare MuJoCo and Drake. Raises `UsageError`, and `IowbcError` where they differ."""
    options.require_extra("train", "iowbc bench")
    from iowbc.benchmarks import engines

    differing = [row.name for row in engines.main(robot_folder(robot)) if not row.agrees]
    if differing:
        raise IowbcError(f"the engines differ by more than expected: {', '.join(differing)}")


def _checked(runs: Path, file: Path | None, scene: str) -> Recipe:
    """The recipe in a file, or the default one. Raises `UsageError` where anything that it needs is missing."""
    recipe = load_recipe(file).recipe if file is not None else Recipe(name="bench")
    require_known(scene, "scene", recipe.simulation.scenes.names)
    options.require_extra("train", "iowbc bench")
    require_writable_runs(Runs(runs))
    return recipe
