"""`iowbc bench`: the speed of this machine; figures of training and simulation go to MLflow."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from iowbc.commands.needs import require_training
from iowbc.deploy.timing import step_seconds
from iowbc.errors import IowbcError, UsageError, require_known
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.tracker import record_figures
from iowbc.pipeline.writability import require_writable_runs
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import SCENES
from iowbc.robot.description import robot_folder


def simulation(
    runs: Runs, file: Path | None, *, scene: str, environments: int, workers: Sequence[int], others: bool
) -> None:
    """Measure the vector environment, of the default recipe or of one in a file. Raises `UsageError`."""
    recipe = _recipe(runs, file, scene)
    from iowbc.benchmarks import simulation

    figures = simulation.main(recipe, scene=scene, environments=environments, workers=tuple(workers), others=others)
    record_figures(runs, "bench-sim", figures)


def training(runs: Runs, file: Path | None, *, scene: str, turns: int, others: int | None) -> None:
    """Measure the teacher's training, of the default recipe or of one in a file. Raises `UsageError`."""
    recipe = _recipe(runs, file, scene)
    from iowbc.benchmarks import training

    record_figures(runs, "bench-train", training.main(recipe, scene=scene, turns=turns, others=others))


def reference(runs: Runs, file: Path | None, *, workers: Sequence[int]) -> None:
    """Measure the labelling of samples, of the default recipe or of one in a file. Raises `UsageError`."""
    recipe = _recipe(runs, file)
    from iowbc.benchmarks import reference

    record_figures(runs, "bench-rg", reference.main(recipe, workers=tuple(workers)))


def control(what: str, steps: int) -> None:
    """Measure and print the time of a control step, with nothing loaded but what a robot's computer has. Raises
    ContractBroken where there is no exported controller."""
    print(f"{what}: {steps:,} control steps of one robot on one thread")
    print(f"{'':16}{'median':>12}{'99th percentile':>18}{'longest':>12}")
    for name, taken in zip(("time", "processor time"), 1e3 * step_seconds(what, steps).T, strict=True):
        median, late, longest = (f"{value:.3f} ms" for value in np.quantile(taken, (0.5, 0.99, 1.0)))
        print(f"{name:16}{median:>12}{late:>18}{longest:>12}")


def engines(robot: str) -> None:
    """Compare MuJoCo and Drake in experiments where they must agree. Raises `UsageError` without Drake or
    for an unknown robot, and `IowbcError` where they differ."""
    require_training("bench")
    from iowbc.benchmarks import engines

    try:
        folder = robot_folder(robot)
    except FileNotFoundError as error:
        raise UsageError(str(error)) from None
    differing = [row.name for row in engines.main(folder) if not row.agrees]
    if differing:
        raise IowbcError(f"the engines differ by more than expected: {', '.join(differing)}")


def _recipe(runs: Runs, file: Path | None, scene: str | None = None) -> Recipe | None:
    """The recipe in a file, once everything that a benchmark needs is there; None for the default one. Raises
    `UsageError`, also for a scene that it does not have."""
    recipe = load_recipe(file).recipe if file is not None else None
    if scene is not None:
        require_known(scene, "scene", SCENES if recipe is None else recipe.simulation.scenes.names)
    require_training("bench")
    require_writable_runs(runs)
    return recipe
