"""The commands. Heavy imports wait until a command needs them, so that `iowbc --help` is fast."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable
from typing import Annotated

import typer

from iowbc.cli import driving, listing, measuring, playing, preparing, running
from iowbc.commands.process import described, leave, let_go, prepare_streams
from iowbc.processes import name_glfw

COMMANDS: dict[str, Callable[..., None]] = {
    "run": running.run,
    "sweep": running.sweep,
    "plan": running.plan,
    "publish": running.publish,
    "init": preparing.init,
    "status": listing.status,
    "ls": listing.list_,
    "show": listing.show,
    "diff": listing.diff,
    "compare": listing.compare,
    "report": listing.report,
    "export": playing.export,
    "gc": listing.gc,
    "play": playing.play,
    "robot": driving.robot,
    "robot-sim": driving.robot_sim,
    "ui": listing.ui,
    "schema": preparing.schema,
    "doctor": preparing.doctor,
}
"""In the order of `iowbc --help`."""
BENCHMARKS: dict[str, Callable[..., None]] = {
    "sim": measuring.bench_simulation,
    "train": measuring.bench_training,
    "rg": measuring.bench_reference,
    "control": measuring.bench_control,
    "carry": measuring.bench_carry,
    "engines": measuring.bench_engines,
}

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


for name, command in COMMANDS.items():
    app.command(name)(command)
for name, command in BENCHMARKS.items():
    bench.command(name)(command)


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit: 0 done, 1 a stage failed, 2 the recipe or the usage is wrong, 130 interrupted."""
    signal.signal(signal.SIGINT, leave)
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    name_glfw()
    prepare_streams()
    code: str | int | None = 1
    try:
        try:
            app(arguments, prog_name="iowbc")
        except SystemExit as ended:
            code = ended.code
            sys.stdout.flush()
    except BrokenPipeError:
        code = 1  # a reader that has gone away, as of `| head`
    except Exception as error:
        from iowbc.errors import IowbcError

        expected = isinstance(error, IowbcError)
        code = error.exit_code if isinstance(error, IowbcError) else 1
        with contextlib.suppress(OSError):
            print(error if expected else described(error, arguments or sys.argv[1:]), file=sys.stderr)
    let_go()
    sys.exit(code)
