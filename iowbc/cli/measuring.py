"""The benchmarks: of this machine, `bench engines` of two engines, `bench carry` of a public controller."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from iowbc.cli.options import RunsFolder, SceneName, runs_folder
from iowbc.commands import completion

BenchRecipe = Annotated[Path | None, typer.Argument(help="Recipe file (default: built-in values).", metavar="RECIPE")]
BenchWorkers = Annotated[list[int] | None, typer.Option("--workers", help="Worker processes (repeatable).", min=1)]


def bench_simulation(
    recipe: BenchRecipe = None,
    scene: SceneName = "lift",
    environments: Annotated[int, typer.Option(help="Environments per worker.", min=1)] = 48,
    workers: BenchWorkers = None,
    others: Annotated[bool, typer.Option(help="Also measure the usual vector environments (default: on).")] = True,
    runs: RunsFolder = None,
) -> None:
    """Measure how fast the vector environment steps, against a bare loop of MuJoCo; the figures go to MLflow."""
    from iowbc.commands.bench import simulation

    simulation(runs_folder(runs), recipe, scene=scene, environments=environments, workers=workers or (), others=others)


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
    """Measure how fast the teacher trains, against plain stable-baselines3; the figures go to MLflow."""
    from iowbc.commands.bench import training

    training(runs_folder(runs), recipe, scene=scene, turns=turns, others=others)


def bench_reference(recipe: BenchRecipe = None, workers: BenchWorkers = None, runs: RunsFolder = None) -> None:
    """Measure how fast the reference generator's samples are labelled, by each method; the figures go to MLflow."""
    from iowbc.commands.bench import reference

    reference(runs_folder(runs), recipe, workers=workers or ())


def bench_control(
    what: Annotated[
        str,
        typer.Argument(
            help="Export folder, or the recipe that made it.", metavar="WHAT", autocompletion=completion.ran
        ),
    ],
    steps: Annotated[int, typer.Option(help="Number of control steps.", min=1)] = 5000,
) -> None:
    """Measure how long a control step of an exported controller takes on one thread, without torch or a simulator."""
    from iowbc.commands.bench import control

    control(what, steps)


def bench_carry(
    policy: Annotated[
        str, typer.Argument(help="Controller: a file, a folder, or PACKAGE:PATH of an installed package.")
    ],
    adapter: Annotated[
        str,
        typer.Option(help="Its adapter: a Python file, `holosoma` or `deploy`.", metavar="FILE"),
    ],
    arms: Annotated[
        Literal["measured", "default"], typer.Option(help="How it observes the arms: as they are, or at its default.")
    ] = "measured",
    posture: Annotated[bool, typer.Option("--posture", help="Also give it commanded height and torso pitch.")] = False,
    workers: Annotated[int | None, typer.Option(help="Worker processes (default: all available cores).", min=1)] = None,
    out: Annotated[Path, typer.Option(help="Page to write.", metavar="FILE")] = Path("carry.md"),
) -> None:
    """Measure a controller that others trained in a fixed suite of lifts and pushes, and write a page of results."""
    from iowbc.commands.bench_carry import carry

    carry(policy, adapter, arms=arms, posture=posture, workers=workers, out=out)


def bench_engines(
    robot: Annotated[str, typer.Argument(help="Robot, by name or folder.", metavar="ROBOT")] = "g1",
) -> None:
    """Compare MuJoCo and Drake in experiments where they must agree; needs the extra `drake`."""
    from iowbc.commands.bench import engines

    engines(robot)
