"""The commands. Nothing heavy is imported before a command needs it, so that `iowbc --help` answers at once."""

import contextlib
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from iowbc.commands import completion
from iowbc.commands.interrupt import leave
from iowbc.commands.streams import let_go, outlasting_readers, prepare_streams
from iowbc.commands.unforeseen import told

if TYPE_CHECKING:
    from rich.console import Console

    from iowbc.commands.request import Request
    from iowbc.pipeline.store.runs import Runs
    from iowbc.pipeline.store.store import Store

app = typer.Typer(
    help="Train, test and export a whole-body controller of a humanoid robot that carries and pushes heavy objects.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"max_content_width": 120},
)
bench = typer.Typer(help="Measure the speed of this machine.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(bench, name="bench")

PIPE_WIDTH = 160
"""Characters in a line of a table where the output is not a terminal."""
RecipeFile = Annotated[
    str,
    typer.Argument(help="Recipe, a YAML file or the name of one.", metavar="RECIPE", autocompletion=completion.recipes),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Change a value of the recipe; repeat for more.",
        metavar="A.B.C=VALUE",
        autocompletion=completion.paths,
    ),
]
RunsFolder = Annotated[
    Path | None,
    typer.Option("--runs", help="Folder of artifacts and tracking; IOWBC_RUNS, else ./runs.", envvar="IOWBC_RUNS"),
]
SweepFile = Annotated[
    Path | None, typer.Option("--from", help="File with a grid, draws or both: what a sweep varies.", metavar="YAML")
]
Until = Annotated[
    str | None, typer.Option(help="Stop after this stage.", metavar="STAGE", autocompletion=completion.stages)
]
Force = Annotated[
    list[str] | None,
    typer.Option(help="Make this stage anew; repeat for more.", metavar="STAGE", autocompletion=completion.stages),
]
Workers = Annotated[int | None, typer.Option(help="Worker processes; all available cores.", min=1)]
SceneName = Annotated[str, typer.Option("--scene", help="Scene of the recipe.", metavar="SCENE")]
BenchRecipe = Annotated[Path | None, typer.Argument(help="Recipe, a YAML file; the defaults.", metavar="RECIPE")]
BenchWorkers = Annotated[
    list[int] | None, typer.Option("--workers", help="Worker processes; repeat to measure several.", min=1)
]
OnCodeChange = Annotated[
    Literal["report", "rerun"], typer.Option(help="What to do about a cached stage whose code has changed since.")
]

RanRecipes = Annotated[
    list[str],
    typer.Argument(help="Recipes that have run.", metavar="RECIPE...", autocompletion=completion.ran),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]
Named = Annotated[
    str,
    typer.Argument(
        help="Recipe (name or file), RECIPE/STAGE, or first characters of a key.",
        metavar="WHAT",
        autocompletion=completion.artifacts,
    ),
]


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
    """What comes before a command."""


@app.command()
def run(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    workers: Workers = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run, as `plan` does.")] = False,
    on_code_change: OnCodeChange = "report",
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but what goes wrong.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print a plain line for every step of progress.")
    ] = False,
    runs: RunsFolder = None,
) -> None:
    """Run a recipe: make every stage that is not cached, and resume what was interrupted."""
    from iowbc.commands.plan import plan as print_plan
    from iowbc.commands.run import run as run_recipe
    from iowbc.stages.registry import STAGES

    request = _request(recipe, overrides, until, force, workers, on_code_change, runs)
    if dry_run:
        print_plan(request, STAGES, _console())
    else:
        with outlasting_readers():
            raise typer.Exit(
                run_recipe(request, STAGES, _console(), "quiet" if quiet else "verbose" if verbose else "usual")
            )


@app.command()
def sweep(
    recipe: RecipeFile,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Vary a value (a,b or 0..4), or change it for all; repeat for a grid.",
            metavar="A.B.C=VALUES",
            autocompletion=completion.paths,
        ),
    ] = None,
    file: SweepFile = None,
    jobs: Annotated[int, typer.Option(help="Points that run at the same time; they share the cores.", min=1)] = 1,
    until: Until = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes of each point.", min=1)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run, as `plan` does.")] = False,
    on_code_change: OnCodeChange = "report",
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but what goes wrong.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="With --dry-run: print JSON.")] = False,
    runs: RunsFolder = None,
) -> None:
    """Run a recipe with every combination of some values; stages that points share are made once."""
    from iowbc.commands.sweep import SweepRequest, plan_sweep
    from iowbc.commands.sweep import sweep as run_sweep
    from iowbc.stages.registry import STAGES

    asked = SweepRequest(_request(recipe, overrides, until, None, workers, on_code_change, runs), file, jobs)
    if dry_run:
        plan_sweep(asked, STAGES, _console(), as_json)
    else:
        with outlasting_readers():
            raise typer.Exit(run_sweep(asked, STAGES, _console(), quiet))


@app.command()
def plan(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    on_code_change: OnCodeChange = "report",
    as_sweep: Annotated[bool, typer.Option("--sweep", help="Of a sweep, where --set may name several values.")] = False,
    file: SweepFile = None,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """Say for each stage whether it is cached or would run, why, and how long it takes."""
    from iowbc.commands.plan import plan as print_plan
    from iowbc.commands.sweep import SweepRequest, plan_sweep
    from iowbc.stages.registry import STAGES

    request = _request(recipe, overrides, until, force, None, on_code_change, runs)
    if as_sweep or file is not None:
        plan_sweep(SweepRequest(request, file, 1), STAGES, _console(), as_json)
    else:
        print_plan(request, STAGES, _console(), as_json)


@app.command()
def publish(recipe: RecipeFile, overrides: Overrides = None, until: Until = None, runs: RunsFolder = None) -> None:
    """Put a recipe's finished artifacts into the repository (runs/published): a fresh clone starts from them."""
    from iowbc.commands.publish import publish_recipe
    from iowbc.stages.registry import STAGES

    publish_recipe(_request(recipe, overrides, until, None, None, "report", runs), STAGES, _console())


def _request(
    recipe: str,
    overrides: list[str] | None,
    until: str | None,
    force: list[str] | None,
    workers: int | None,
    on_code_change: Literal["report", "rerun"],
    runs: Path | None,
) -> "Request":
    from iowbc.commands.request import Request
    from iowbc.pipeline.planner import Options

    options = Options(until, frozenset(force or ()), on_code_change, workers)
    return Request(recipe, tuple(overrides or ()), _runs(runs), options)


@app.command()
def init(
    folder: Annotated[Path, typer.Argument(help="Folder to make or to fill.", metavar="DIR")],
    robot: Annotated[str, typer.Option(help="Robot whose description is copied.")] = "g1",
) -> None:
    """Copy the recipes and a robot's description into a folder to begin from."""
    from iowbc.commands.init import begin

    begin(folder, robot, _console())


@app.command()
def status(as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show what runs, what was left unfinished, and what each recipe has."""
    from iowbc.commands.status import print_status

    print_status(_store(runs), _console(), as_json)


@app.command("ls")
def list_(
    stage: Annotated[
        str | None, typer.Argument(help="Only artifacts of this stage.", autocompletion=completion.stages)
    ] = None,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """List the stored artifacts."""
    from iowbc.commands.ls import list_artifacts

    list_artifacts(_store(runs), _console(), stage, as_json)


@app.command()
def show(what: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show an artifact in detail, or the stages and metrics of a recipe."""
    from iowbc.commands.show import show as print_artifact

    print_artifact(_store(runs), _console(), what, as_json)


@app.command()
def diff(first: Named, second: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show how two recipes or artifacts differ: recipe, keys, versions, code, metrics."""
    from iowbc.commands.diff import diff as print_differences

    print_differences(_store(runs), _console(), first, second, as_json)


@app.command()
def compare(
    recipes: Annotated[
        list[str],
        typer.Argument(help="Recipes that have run, two or more.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, typer.Option(help="Folder to write to; runs/compare.")] = None,
    film: Annotated[bool, typer.Option("--film", help="Also film one trial with all of them side by side.")] = False,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """Write tables and figures over several runs."""
    from iowbc.commands.compare import compare as write_comparison

    store = _store(runs)
    write_comparison(store, _console(), recipes, output or store.runs.root / "compare", film, as_json)


@app.command()
def report(
    recipes: Annotated[
        list[str],
        typer.Argument(help="Recipes that have run, one or more.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, typer.Option(help="HTML file to write; runs/report/RECIPE.html.")] = None,
    runs: RunsFolder = None,
) -> None:
    """Write one HTML page about runs: tables, interactive curves, films, differences; it opens without a network."""
    from iowbc.commands.report import report as write_report

    store = _store(runs)
    name = "-".join(Path(recipe).stem for recipe in recipes)
    write_report(store, _console(), recipes, output or store.runs.reports / f"{name}.html")


@app.command()
def export(
    what: Annotated[
        str,
        typer.Argument(
            help="Recipe, RECIPE/export, key, or the folder of an export.",
            metavar="WHAT",
            autocompletion=completion.artifacts,
        ),
    ],
    web: Annotated[Path, typer.Option("--web", help="Folder of the web page to write.", metavar="DIR")],
    runs: RunsFolder = None,
) -> None:
    """Write an exported controller as a web page, in which the robot moves on the visitor's machine (needs npm)."""
    from iowbc.commands.export import export_page

    export_page(_store(runs), _console(), what, web)


@app.command()
def gc(
    unused: Annotated[bool, typer.Option("--unused", help="Artifacts that no recipe ever used.")] = False,
    recipe: Annotated[
        list[str] | None, typer.Option(help="This recipe's record, and artifacts that only it used.")
    ] = None,
    work: Annotated[bool, typer.Option("--work", help="Checkpoints of stages that did not finish.")] = False,
    damaged: Annotated[bool, typer.Option("--damaged", help="Artifacts that were set aside as damaged.")] = False,
    older_than: Annotated[float, typer.Option(help="Only what is older than this.", min=0.0, metavar="DAYS")] = 0.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list what would be removed.")] = False,
    runs: RunsFolder = None,
) -> None:
    """Remove artifacts and checkpoints; refuses without a scope."""
    from iowbc.commands.gc import Scope, collect

    scope = Scope(unused, tuple(recipe or ()), work, damaged, older_than)
    collect(_store(runs), _console(), scope, dry_run)


@app.command()
def play(
    what: Annotated[str, typer.Argument(help="Recipe, RECIPE/STAGE, key, or the folder of an export.", metavar="WHAT")],
    stage: Annotated[str | None, typer.Option(help="export, distill or teacher; the last one there is.")] = None,
    scene: SceneName = "lift",
    mass: Annotated[float, typer.Option(help="Mass of the object [kg]; 0 for none.", min=0.0)] = 4.0,
    partner_share: Annotated[
        float, typer.Option(help="Part of the weight that a partner bears.", min=0.0, max=1.0)
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    disturbances: Annotated[bool, typer.Option("--disturbances", help="With impulses and pushes.")] = False,
    video: Annotated[Path | None, typer.Option(help="Make a film instead of opening a window.", metavar="MP4")] = None,
    web: Annotated[bool, typer.Option("--web", help="Drive it in the browser; needs no display.")] = False,
    port: Annotated[int | None, typer.Option(help="Port of --web; 8080.", min=1, max=65535)] = None,
    runs: RunsFolder = None,
) -> None:
    """Watch a trained policy in the viewer, drive it in the browser, or make a film of it."""
    from iowbc.commands.play import PlayRequest, play_word
    from iowbc.commands.play_web import PORT, play_on_web
    from iowbc.errors import UsageError

    request = PlayRequest(
        scene=scene, mass=mass, partner_share=partner_share, seed=seed, disturbances=disturbances, video=video
    )
    if web:
        play_on_web(_store(runs), _console(), what, stage, request, port or PORT)
    elif port is not None:
        raise UsageError("--port is that of the page that --web serves; give both")
    else:
        raise typer.Exit(play_word(_store(runs), _console(), what, stage, request))


@bench.command("sim")
def bench_simulation(
    recipe: BenchRecipe = None,
    scene: SceneName = "lift",
    environments: Annotated[int, typer.Option(help="Environments a worker.", min=1)] = 48,
    workers: BenchWorkers = None,
    others: Annotated[bool, typer.Option(help="Also measure the usual vector environments.")] = True,
    runs: RunsFolder = None,
) -> None:
    """Measure how fast the vector environment steps, against a bare loop of MuJoCo; the figures go to MLflow."""
    from iowbc.commands.bench import simulation

    simulation(_runs(runs), recipe, scene=scene, environments=environments, workers=workers or (), others=others)


@bench.command("train")
def bench_training(
    recipe: BenchRecipe = None,
    scene: SceneName = "lift",
    turns: Annotated[int, typer.Option(help="Updates to measure.", min=1)] = 6,
    others: Annotated[
        int | None, typer.Option(help="Processes of stable-baselines3; one a core, 0 leaves it out.", min=0)
    ] = None,
    runs: RunsFolder = None,
) -> None:
    """Measure how fast the teacher trains, against plain stable-baselines3; the figures go to MLflow."""
    from iowbc.commands.bench import training

    training(_runs(runs), recipe, scene=scene, turns=turns, others=others)


@bench.command("rg")
def bench_reference(recipe: BenchRecipe = None, workers: BenchWorkers = None, runs: RunsFolder = None) -> None:
    """Measure how fast the reference generator's samples are labelled, by each method; the figures go to MLflow."""
    from iowbc.commands.bench import reference

    reference(_runs(runs), recipe, workers=workers or ())


@app.command()
def ui(
    port: Annotated[int, typer.Option(help="Port on this machine.", min=1, max=65535)] = 5000, runs: RunsFolder = None
) -> None:
    """Open MLflow's web interface on the runs, for this machine alone."""
    from iowbc.commands.ui import serve

    raise typer.Exit(serve(_runs(runs), _console(), port))


@app.command()
def schema(output: Annotated[Path | None, typer.Option(help="File to write to, instead of printing.")] = None) -> None:
    """Write the JSON Schema of recipes, for editors."""
    from iowbc.commands.schema import write_schema

    write_schema(output)


@app.command()
def doctor(runs: RunsFolder = None) -> None:
    """Check versions, binaries, rendering, cores, memory and disk."""
    from iowbc.commands.doctor import examine

    raise typer.Exit(examine(_runs(runs), _console()))


def _console() -> "Console":
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    width = int(columns) if columns.isdecimal() and int(columns) > 0 else PIPE_WIDTH
    return Console(width=None if sys.stdout.isatty() else width)


def _store(folder: Path | None) -> "Store":
    from iowbc.pipeline.store.store import Store

    return Store(_runs(folder))


def _runs(folder: Path | None) -> "Runs":
    from iowbc.pipeline.store.runs import Runs

    return Runs(folder or Path("runs"))


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit: 0 done, 1 a stage failed, 2 the recipe or the usage is wrong, 130 interrupted."""
    signal.signal(signal.SIGINT, leave)
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
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

        foreseen = isinstance(error, IowbcError)
        code = error.exit_code if isinstance(error, IowbcError) else 1
        with contextlib.suppress(OSError):
            print(error if foreseen else told(error, arguments or sys.argv[1:]), file=sys.stderr)
    let_go()
    sys.exit(code)
