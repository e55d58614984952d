"""The command line: name, help and module of every command.

A command's module is imported when the command is called or completed, so that `iowbc --help` is fast.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Callable
from pkgutil import resolve_name
from typing import Annotated, Any

import typer
from typer.core import TyperCommand
from typer.main import get_command

from iowbc.commands.process import described, leave, let_go, prepare_streams, require_text
from iowbc.processes import name_glfw

COMMANDS = {
    "run": "Run a recipe: run every stage that is not cached, and resume interrupted ones.",
    "sweep": "Run a recipe with every combination of given values; shared stages run once.",
    "plan": "Show whether each stage is cached or would run, the reason, and the expected time.",
    "publish": "Copy a recipe's finished artifacts to the repository (runs/published), where a fresh clone finds them.",
    "init": "Copy the recipes and a robot description into a folder of your own.",
    "status": "Show running and unfinished stages, and the artifacts of each recipe.",
    "ls": "List the stored artifacts.",
    "show": "Show an artifact in detail, or the stages and metrics of a recipe.",
    "diff": "Show how two recipes or artifacts differ: recipe, keys, versions, code, metrics.",
    "compare": "Compare several runs in tables and figures.",
    "report": "Write one HTML page about runs: tables, interactive curves, films, differences; readable offline.",
    "export": "Write a web page that simulates an exported controller in the browser (needs npm).",
    "gc": "Remove artifacts and checkpoints, selected by at least one option.",
    "play": "Watch a trained policy in the viewer, drive it in the browser, or record a film.",
    "robot": "Drive a robot on its bus with an exported controller; never tried on hardware, see docs/deployment.md.",
    "robot-sim": "Simulate a robot on the bus, which `iowbc robot` can drive.",
    "ui": "Open MLflow's web interface for the runs, on this machine only.",
    "schema": "Write the JSON Schema of recipes, for editors.",
    "doctor": "Check versions, binaries, rendering, cores, memory and disk.",
}
"""Help of each command, in the order of `iowbc --help`."""
BENCHMARKS = {
    "sim": "Measure the vector environment's speed against a bare MuJoCo loop; results go to MLflow.",
    "train": "Measure the teacher's training speed against plain stable-baselines3; results go to MLflow.",
    "control": "Measure the control step's time of an exported controller on one thread, without torch or a simulator.",
    "carry": "Evaluate a public controller on a fixed suite of lifts and pushes, and write a page of results.",
}
"""The same of `iowbc bench`."""
MODULES = {"status": "listing", "ls": "listing", "show": "listing", "report": "compare", "robot-sim": "robot"}
MODULES |= {"schema": "init"} | dict.fromkeys(BENCHMARKS, "bench")
"""Modules in `iowbc.commands` of commands without one of their name."""


class LazyCommand(TyperCommand):
    """A command listed by name and help; its callback imports the function when the command is called."""

    def make_context(self, *arguments: Any, **settings: Any) -> Any:
        """The context of the command with its own parameters."""
        assert self.callback is not None, "every command is given one below"
        command = typer.Typer(add_completion=False, rich_markup_mode=None)
        command.command(self.name, help=self.help)(self.callback())
        return get_command(command).make_context(*arguments, **settings)


def _importing(name: str) -> Callable[[], Any]:
    """A function that imports and returns the function of a command, which has the command's name."""
    return lambda: resolve_name(f"iowbc.commands.{MODULES.get(name, name)}:{name.replace('-', '_')}")


app = typer.Typer(
    help="Train, test and export a whole-body controller of a humanoid robot that carries and pushes heavy objects.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"max_content_width": 120},
)
bench = typer.Typer(
    help="Benchmark this machine, physics engines, or a public controller.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(bench, name="bench")
for group, commands in ((app, COMMANDS), (bench, BENCHMARKS)):
    for name, text in commands.items():
        group.command(name, cls=LazyCommand, help=text)(_importing(name))


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"iowbc {version('iowbc')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Options that come before a command."""


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit: 0 done, 1 a stage failed, 2 the recipe or the usage is wrong, 130 interrupted."""
    signal.signal(signal.SIGINT, leave)
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    name_glfw()
    prepare_streams()
    code: str | int | None = 1
    try:
        require_text(arguments or sys.argv[1:])
        try:
            app(arguments, prog_name="iowbc")
        except SystemExit as ended:
            code = ended.code
            sys.stdout.flush()
    except BrokenPipeError:
        code = 1  # the reader has closed the pipe, as `| head` does
    except Exception as error:
        from iowbc.errors import IowbcError

        expected = isinstance(error, IowbcError)
        code = error.exit_code if isinstance(error, IowbcError) else 1
        with contextlib.suppress(OSError):
            print(error if expected else described(error, arguments or sys.argv[1:]), file=sys.stderr)
    let_go()
    sys.exit(code)
