"""`iowbc bench`: benchmarks of this machine, and of others' controllers on a fixed suite."""

import json
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from typer import Argument, Option

from iowbc.commands import options
from iowbc.errors import UsageError, require_known
from iowbc.files import data_digest, file_digest
from iowbc.pipeline.store.runs import Runs, require_writable, require_writable_runs
from iowbc.pipeline.tracking.tracker import record_figures
from iowbc.processes import available_cores
from iowbc.recipe.reading.loading import load_recipe, recipe_file
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.results.table import ABSENT, Cell, Column, Table, heads, markdown, measured
from iowbc.robot.description import robot_folder

if TYPE_CHECKING:
    import pandas as pd

BenchRecipe = Annotated[Path | None, Argument(help="Recipe file (default: built-in values).", metavar="RECIPE")]
SUITES = {"mujoco": "carry.yaml", "drake": "carry_drake.yaml"}
"""Suite of each engine, in the folder `public` of the recipes."""
NO_DRAKE = "not installed: pip install '.[drake]' in a checkout"
FIGURES = {
    "E_v": (Column("E_v", "m/s"), ".3f"),
    "E_psi": (Column("E_ψ", "rad"), ".3f"),
    "transport_robot": (Column("way"), ".2f"),
    "hand_force_p95": (Column("hand", "N"), ".0f"),
    "handle_force_p95": (Column("handle", "N"), ".0f"),
}
"""Columns of the page and their formats."""
MEANING = (
    "E_v and E_ψ: errors of velocity and heading, means over the trials that were survived. Way: part of the commanded "
    "way covered; hand, handle: 95th percentile of the horizontal force between a hand and the object, and between "
    "partner and object; time: until the end or the fall; means over all trials. Alike: trials with the same outcome "
    "in both engines."
)


def sim(
    recipe: BenchRecipe = None,
    scene: options.SceneName = "lift",
    environments: Annotated[int, Option(help="Environments per worker.", min=1)] = 48,
    workers: Annotated[list[int] | None, Option(help="Worker processes (repeatable).", min=1)] = None,
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
    turns: Annotated[int, Option(help="Number of updates.", min=1)] = 6,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Measure the teacher's training. Raises `UsageError`."""
    own = _checked(runs, recipe, scene)
    from iowbc.benchmarks import training

    record_figures(Runs(runs), "bench-train", training.main(own, scene=scene, turns=turns))


def control(
    what: options.Exported,
    steps: Annotated[int, Option(help="Number of control steps.", min=1)] = 5000,
    skill: Annotated[Path | None, Option(help="Folder of a skill that commands the controller.")] = None,
) -> None:
    """Measure the control step's time of an exported controller, and print it in quantiles."""
    from iowbc.deploy.timing import step_seconds

    print(f"{what}: {steps:,} control steps of one robot on one thread")
    print(f"{'':16}{'median':>12}{'99th percentile':>18}{'longest':>12}")
    for name, taken in zip(("time", "processor time"), 1e3 * step_seconds(what, steps, skill).T, strict=True):
        median, late, longest = (f"{value:.3f} ms" for value in np.quantile(taken, (0.5, 0.99, 1.0)))
        print(f"{name:16}{median:>12}{late:>18}{longest:>12}")


def _checked(runs: Path, file: Path | None, scene: str) -> Recipe:
    """The recipe in a file, or the default one. Raises `UsageError` where anything that it needs is missing."""
    recipe = load_recipe(file).recipe if file is not None else Recipe(name="bench")
    require_known(scene, "scene", recipe.simulation.scenes.names)
    options.require_extra("train", "iowbc bench")
    require_writable_runs(Runs(runs))
    return recipe


def carry(
    policy: Annotated[str, Argument(help="Controller: a file, a folder, or PACKAGE:PATH of an installed package.")],
    adapter: Annotated[str, Option(help="Its adapter: a Python file, `holosoma` or `deploy`.", metavar="FILE")],
    arms: Annotated[
        Literal["measured", "default", "free", "own"],
        Option(
            help="Arms held by this project and observed as measured or in the controller's default posture; or moved "
            "by the controller in all trials (own) or in those without an object (free)."
        ),
    ] = "measured",
    posture: Annotated[bool, Option("--posture", help="Also send it commanded height and torso pitch.")] = False,
    engine: Annotated[
        Literal["mujoco", "both"] | None,
        Option(help="MuJoCo alone, or some cells in Drake, too (default: both where Drake is installed)."),
    ] = None,
    workers: options.Workers = None,
    out: Annotated[Path, Option(help="Output page.", metavar="FILE")] = Path("carry.md"),
) -> None:
    """Play the suites and write the page. Raises UsageError, and StageFailed where the controller cannot be used."""
    options.require_extra("train", "iowbc bench carry")
    from iowbc.adapters.source import SHIPPED, policy_digest, policy_path

    own, drake = adapter not in SHIPPED, drake_version()
    if own and not Path(adapter).is_file():
        raise UsageError(f"--adapter {adapter}: no such file; give a Python file, or one of {', '.join(SHIPPED)}")
    if out.suffix != ".md":
        raise UsageError(f"--out {out}: a page is a Markdown file; give a name that ends in .md")
    if engine == "both" and drake is None:
        raise UsageError(f"--engine both: Drake is {NO_DRAKE}, or give --engine mujoco")
    require_writable(out.parent, "--out")
    digest = policy_digest(policy_path(policy))
    values = {"adapter": "own" if own else adapter, "policy": policy, "sha256": digest, "arms": arms}
    if own:
        values["module"] = str(Path(adapter).resolve())
    overrides = [f"eval.public.{name}={json.dumps(value)}" for name, value in values.items()]
    overrides.append(f"task.references.upright={json.dumps(not posture)}")
    files = {name: recipe_file(str(Path("public", file))) for name, file in SUITES.items()}
    skipped = "left out by --engine mujoco" if engine == "mujoco" else None if drake else NO_DRAKE
    recipes = {name: load_recipe(files[name], overrides).recipe for name in SUITES if name == "mujoco" or not skipped}
    played = {name: _play(recipe, workers or available_cores()) for name, recipe in recipes.items()}
    controller = recipes["mujoco"].eval.public
    assert controller is not None, "it is among the overrides"
    source = Path(adapter) if own else Path(SHIPPED[adapter].__code__.co_filename)
    given = "height and pitch" if posture else "velocities alone"
    rows = {
        "controller": f"{Path(policy.partition(':')[2] or policy).name}, SHA-256 {digest}",
        "adapter": f"{source.name}, SHA-256 {file_digest(source)}",
        "settings": f"arms {arms}, {given}, heading gain {controller.heading_gain:g} 1/s",
        "suite": _suite_row(files["mujoco"], played["mujoco"]),
        f"in Drake {drake or ''}".strip(): skipped or _suite_row(files["drake"], played["drake"]),
    }
    head = "\n".join(f"| {name} | {text} |" for name, text in rows.items())
    table = _suite_table(**played)
    page = f"# Carry bench\n\n| | |\n| --- | --- |\n{head}\n\n{markdown(table)}\n{MEANING}\n"
    out.write_text(page, encoding="utf-8")
    print(markdown(table), end="")
    print(f"page  {out}")


def drake_version() -> str | None:
    """Version of Drake, where it is installed."""
    try:
        return version("drake")
    except PackageNotFoundError:
        return None


def _play(recipe: Recipe, workers: int) -> "pd.DataFrame":
    """The trials of a suite with the controller that it names."""
    from iowbc.evaluation.trials.protocol import Protocol
    from iowbc.stages.eval import world_and_policy

    reached = 0

    def progress(done: float, total: float, note: str) -> None:
        nonlocal reached
        if int(10 * done / total) > reached:
            reached = int(10 * done / total)
            print(f"{recipe.name}: {done:.0f} of {total:.0f} trials, {note}", flush=True)

    world, policy = world_and_policy(recipe, robot=robot_folder(recipe.robot))
    with tempfile.TemporaryDirectory(prefix="iowbc-carry-") as work:
        return Protocol(world, policy, work=Path(work), workers=workers, progress=progress).run()


def _suite_row(file: Path, trials: "pd.DataFrame") -> str:
    """Name and digest of a suite, and how many of its trials succeeded."""
    suite = load_recipe(file).recipe
    played = f"{len(trials)} trials, {suite.eval.trials} a cell, {int(trials['succeeded'].sum())} succeeded"
    return f"{file.stem} of iowbc {version('iowbc')}, SHA-256 {suite_digest(suite)}; {played}"


def suite_digest(suite: Recipe) -> str:
    """SHA-256 of the sections that determine a suite's trials; independent of the controller."""
    values = deciding(suite)
    return data_digest({name: values[name] for name in ("simulation", "task", "eval")})


def _suite_table(mujoco: "pd.DataFrame", drake: "pd.DataFrame | None" = None) -> Table:
    """A row for each suite and mass, beside it the same cell in Drake."""
    from iowbc.evaluation.report.aggregate import aggregate

    summary, cell = aggregate(mujoco), ["suite", "case", "mass"]
    cells, others = dict(list(mujoco.groupby(cell))), {} if drake is None else dict(list(drake.groupby(cell)))
    rows = []
    for _, row in summary.iterrows():
        key = tuple(row[cell])
        rows.append(
            (
                str(row["suite"]),
                f"{row['mass']:g} kg" if row["mass"] else "no object",
                f"{row['survived']}/{row['trials']}",
                f"{row['succeeded']}/{row['trials']}",
                f"{cells[key]['seconds'].mean():.1f}",
                *(measured(float(row[name]), form=form) for name, (_, form) in FIGURES.items()),
                *(() if drake is None else _in_drake(cells[key], others.get(key))),
            )
        )
    columns = heads(
        "suite", "load", "survived", "succeeded", Column("time", "s"), *(head for head, _ in FIGURES.values())
    )
    if drake is not None:
        columns += heads("succeeded in Drake", "alike", Column("E_v in Drake", "m/s"))
    return Table("carry", "", columns, rows, summary)


def _in_drake(mujoco: "pd.DataFrame", drake: "pd.DataFrame | None") -> tuple[Cell, ...]:
    """Successes, trials with the same outcome, and E_v of a cell in Drake."""
    if drake is None:
        return (ABSENT,) * 3
    pairs = mujoco.merge(drake, on="trial", suffixes=("", "_drake"))
    alike = int((pairs["succeeded"] == pairs["succeeded_drake"]).sum())
    error = float(drake.loc[drake["survived"], "E_v"].mean())
    return f"{int(drake['succeeded'].sum())}/{len(drake)}", f"{alike}/{len(pairs)}", measured(error)
