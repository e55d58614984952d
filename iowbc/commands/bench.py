"""`iowbc bench`: the speed of this machine; the figures go to MLflow."""

from collections.abc import Sequence
from pathlib import Path

from iowbc.commands.training import require_training
from iowbc.errors import require_known
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.tracker import record_figures
from iowbc.pipeline.writability import require_writable_runs
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import SCENES


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


def _recipe(runs: Runs, file: Path | None, scene: str | None = None) -> Recipe | None:
    """The recipe in a file, once everything that a benchmark needs is there; None for the default one. Raises
    `UsageError`, also for a scene that it does not have."""
    recipe = load_recipe(file).recipe if file is not None else None
    if scene is not None:
        require_known(scene, "scene", SCENES if recipe is None else recipe.simulation.scenes.names)
    require_training("bench")
    require_writable_runs(runs)
    return recipe
