"""Benchmarks of this machine, of two physics engines (`bench engines`) and of a public controller (`bench carry`)."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from iowbc.cli.options import RunsFolder, SceneName, runs_folder
from iowbc.commands import completion

if TYPE_CHECKING:
    from iowbc.recipe.recipe import Recipe

BenchRecipe = Annotated[Path | None, typer.Argument(help="Recipe file (default: built-in values).", metavar="RECIPE")]
BenchWorkers = Annotated[list[int] | None, typer.Option("--workers", help="Worker processes (repeatable).", min=1)]


def bench_simulation(
    recipe: BenchRecipe = None,
    scene: SceneName = "lift",
    environments: Annotated[int, typer.Option(help="Environments per worker.", min=1)] = 48,
    workers: BenchWorkers = None,
    others: Annotated[bool, typer.Option(help="Also measure other vector environments (default: on).")] = True,
    runs: RunsFolder = None,
) -> None:
    """Measure the vector environment's speed against a bare MuJoCo loop; results go to MLflow."""
    own, counts = _checked(runs, recipe, scene), tuple(workers or ())
    from iowbc.benchmarks import simulation

    figures = simulation.main(own, scene=scene, environments=environments, workers=counts, others=others)
    _record(runs, "bench-sim", figures)


def bench_training(
    recipe: BenchRecipe = None,
    scene: SceneName = "lift",
    turns: Annotated[int, typer.Option(help="Number of updates.", min=1)] = 6,
    others: Annotated[
        int | None,
        typer.Option(help="Processes of plain stable-baselines3 (default: one per core; 0 skips it).", min=0),
    ] = None,
    runs: RunsFolder = None,
) -> None:
    """Measure the teacher's training speed against plain stable-baselines3; results go to MLflow."""
    own = _checked(runs, recipe, scene)
    from iowbc.benchmarks import training

    _record(runs, "bench-train", training.main(own, scene=scene, turns=turns, others=others))


def bench_reference(recipe: BenchRecipe = None, workers: BenchWorkers = None, runs: RunsFolder = None) -> None:
    """Measure the speed of each labelling method of the reference generator; results go to MLflow."""
    own = _checked(runs, recipe)
    from iowbc.benchmarks import reference

    _record(runs, "bench-rg", reference.main(own, workers=tuple(workers or ())))


def bench_control(
    what: Annotated[
        str,
        typer.Argument(
            help="Export folder, or the recipe that made it.", metavar="WHAT", autocompletion=completion.ran
        ),
    ],
    steps: Annotated[int, typer.Option(help="Number of control steps.", min=1)] = 5000,
    skill: Annotated[Path | None, typer.Option(help="Folder of a skill that commands the controller.")] = None,
) -> None:
    """Measure the control step's time of an exported controller on one thread, without torch or a simulator."""
    import numpy as np

    from iowbc.deploy.timing import step_seconds

    print(f"{what}: {steps:,} control steps of one robot on one thread")
    print(f"{'':16}{'median':>12}{'99th percentile':>18}{'longest':>12}")
    for name, taken in zip(("time", "processor time"), 1e3 * step_seconds(what, steps, skill).T, strict=True):
        median, late, longest = (f"{value:.3f} ms" for value in np.quantile(taken, (0.5, 0.99, 1.0)))
        print(f"{name:16}{median:>12}{late:>18}{longest:>12}")


def bench_carry(
    policy: Annotated[
        str, typer.Argument(help="Controller: a file, a folder, or PACKAGE:PATH of an installed package.")
    ],
    adapter: Annotated[
        str,
        typer.Option(help="Its adapter: a Python file, `holosoma` or `deploy`.", metavar="FILE"),
    ],
    arms: Annotated[
        Literal["measured", "default", "free", "own"],
        typer.Option(
            help="Arms held by this project and observed as measured or in the controller's default posture; or moved "
            "by the controller in all trials (own) or in those without an object (free)."
        ),
    ] = "measured",
    posture: Annotated[bool, typer.Option("--posture", help="Also send it commanded height and torso pitch.")] = False,
    engine: Annotated[
        Literal["mujoco", "both"] | None,
        typer.Option(help="MuJoCo alone, or some cells in Drake, too (default: both where Drake is installed)."),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes (default: all available cores).", min=1)] = None,
    out: Annotated[Path, typer.Option(help="Output page.", metavar="FILE")] = Path("carry.md"),
) -> None:
    """Evaluate a public controller on a fixed suite of lifts and pushes, and write a page of results."""
    from iowbc.commands.bench_carry import carry

    carry(policy, adapter, arms=arms, posture=posture, workers=workers, out=out, engine=engine)


def bench_engines(
    robot: Annotated[str, typer.Argument(help="Robot, by name or folder.", metavar="ROBOT")] = "g1",
) -> None:
    """Compare MuJoCo and Drake in experiments where they must agree; needs the extra `drake`."""
    from iowbc.commands.needs import require_training
    from iowbc.errors import IowbcError, UsageError
    from iowbc.robot.description import robot_folder

    require_training("bench")
    from iowbc.benchmarks import engines

    try:
        folder = robot_folder(robot)
    except FileNotFoundError as error:
        raise UsageError(str(error)) from None
    differing = [row.name for row in engines.main(folder) if not row.agrees]
    if differing:
        raise IowbcError(f"the engines differ by more than expected: {', '.join(differing)}")


def _checked(runs: Path | None, file: Path | None, scene: str | None = None) -> "Recipe | None":
    """The recipe in a file, once everything that a benchmark needs is there; None for the default one. Raises
    `UsageError`, also for a scene that it does not have."""
    from iowbc.commands.needs import require_training
    from iowbc.errors import require_known
    from iowbc.pipeline.writability import require_writable_runs
    from iowbc.recipe.reading.loading import load_recipe
    from iowbc.recipe.simulation.holding import SCENES

    recipe = load_recipe(file).recipe if file is not None else None
    if scene is not None:
        require_known(scene, "scene", SCENES if recipe is None else recipe.simulation.scenes.names)
    require_training("bench")
    require_writable_runs(runs_folder(runs))
    return recipe


def _record(runs: Path | None, name: str, figures: Mapping[str, float]) -> None:
    from iowbc.pipeline.tracking.tracker import record_figures

    record_figures(runs_folder(runs), name, figures)
