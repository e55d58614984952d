"""`iowbc status`, `iowbc ls` and `iowbc show`: work in progress, stored artifacts, and one of them in detail."""

from pathlib import Path
from typing import Annotated, Any

from rich.columns import Columns
from rich.console import Console
from rich.filesize import decimal
from rich.padding import Padding
from rich.table import Table
from rich.text import Text
from typer import Argument

from iowbc.commands import completion, options
from iowbc.commands.lookup import known_recipes, last_used, named
from iowbc.commands.printed import plain_table, print_json, shown_path, stdout_console, tell
from iowbc.errors import UsageError, require_known, shown
from iowbc.pipeline.console.display import sparkline
from iowbc.pipeline.console.wording import KEY_LENGTH, ago, duration, figure
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import ever_used, named_folder, recall
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import Progress, unfinished
from iowbc.pipeline.tracking.delivery import DAMAGED_LINE
from iowbc.pipeline.tracking.tracker import backlog
from iowbc.recipe.recipe import PIPELINE, Recipe


def status(as_json: options.AsJson = False, runs: options.RunsFolder = options.RUNS) -> None:
    """Print running and unfinished stages, the finished stages of each recipe, and the backlog of MLflow."""
    store, console = Store(Runs(runs)), stdout_console()
    going_on, recipes = unfinished(store.runs), _readable_recipes(store)
    if as_json:
        own = {"stage", "recipe", "done", "total", "seconds", "attempts", "updated", "note"}
        working = [
            record.model_dump(include=own) | {"key": folder.name, "holder": holder(store.runs, folder.name)}
            for folder, record in going_on
        ]
        stages = {name: recall(store.runs, name).stages for name in recipes}
        print_json(console, {"unfinished": working, "recipes": stages, "unsent": len(backlog(store.runs))})
        return
    for folder, record in going_on:
        _print_work(store, console, folder, record)
    stopped = [record.command for folder, record in going_on if not holder(store.runs, folder.name)]
    for command in dict.fromkeys(filter(None, stopped)):
        tell(console, f"to go on: {command}")
    if recipes:
        table = plain_table("recipe", "finished stages", "last")
        for recipe in recipes:
            last = max(ever_used(store.runs, recipe).values(), default=0.0)
            table.add_row(recipe, ", ".join(last_used(store, recipe)), ago(last))
        console.print(table)
    if not (going_on or recipes):
        tell(console, f"nothing has run in {store.runs.root} yet; `iowbc run RECIPE` starts")
    if aside := sorted(store.runs.damaged.glob(f"{DAMAGED_LINE}*")):
        text = f"{len(aside)} damaged lines of MLflow's journals were put aside, as {shown_path(aside[-1])}"
        console.print(text, markup=False, highlight=False)
    if waiting := backlog(store.runs):
        log = shown_path(store.runs.tracking / "sender.log")
        text = f"MLflow lacks something of {len(waiting)} runs; the next run sends it (its log: {log})"
        console.print(text, markup=False, highlight=False)


def _readable_recipes(store: Store) -> list[str]:
    """Names of the recipes that have finished a stage; one with a damaged record is reported and left out."""
    found = []
    for name in known_recipes(store):
        try:
            recall(store.runs, name)
        except UsageError as error:
            tell(Console(stderr=True), str(error))
        else:
            found.append(name)
    return found


def _print_work(store: Store, console: Console, folder: Path, record: Progress) -> None:
    """Print a running or unfinished stage: its process, progress, and curve."""
    who = holder(store.runs, folder.name)
    state = ("runs", "bold yellow") if who else (f"stopped {ago(record.updated)}", "magenta")
    title = f" of {record.recipe} ({folder.name[:KEY_LENGTH]}): "
    by = f", {who}" if who else ""
    console.print(Text.assemble((record.stage, "bold"), title, state, by))
    parts = (record.share, f"{duration(record.seconds)} spent", f"attempt {record.attempts or '?'}", record.note)
    console.print(Padding(Text(", ".join(filter(None, parts))), (0, 0, 0, 2)))
    if values := [value for _, value in record.curve]:
        console.print(Padding(Text(f"{record.metric} {sparkline(values)} {values[-1]:.4g}"), (0, 0, 0, 2)))


def ls(
    stage: Annotated[
        str | None, Argument(help="Only artifacts of this stage.", autocompletion=completion.stages)
    ] = None,
    as_json: options.AsJson = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """A row for each artifact, oldest first. Raises `UsageError` for an unknown stage."""
    store, console = Store(Runs(runs)), stdout_console()
    if stage is not None:
        require_known(stage, "stage", PIPELINE)
    users: dict[str, list[str]] = {}
    for recipe in _readable_recipes(store):
        for key in ever_used(store.runs, recipe):
            users.setdefault(key, []).append(recipe)
    artifacts = store.artifacts(stage)
    if as_json:
        print_json(console, [_data(one) | {"used_by": users.get(one.manifest.key, [])} for one in artifacts])
        return
    table = plain_table("stage", "key", "used by", "made", "took", "size")
    for artifact in artifacts:
        manifest = artifact.manifest
        table.add_row(
            manifest.stage,
            manifest.key[:KEY_LENGTH],
            ", ".join(users.get(manifest.key, [f"{manifest.recipe} (published)" if artifact.published else "-"])),
            ago(manifest.made),
            duration(manifest.seconds),
            decimal(artifact.size),
        )
    if artifacts:
        console.print(table)
    else:
        tell(console, f"no {stage or 'artifact'} is stored in {store.runs.store} yet; `iowbc run RECIPE` makes it")


def show(word: options.Named, as_json: options.AsJson = False, runs: options.RunsFolder = options.RUNS) -> None:
    """All of one artifact, or the stages and metrics of a recipe."""
    store, console = Store(Runs(runs)), stdout_console()
    found = named(store, word)
    if as_json:
        artifacts = [_data(one) | {"ingredients": one.ingredients} for one in found.artifacts.values()]
        print_json(console, {"recipe": found.recipe, "stages": artifacts} if found.recipe else artifacts)
        return
    if found.recipe:
        for stage, artifact in found.artifacts.items():
            manifest = artifact.manifest
            took = f"made {ago(manifest.made)}, took {duration(manifest.seconds)}"
            console.print(Text.assemble((stage, "bold"), f" {manifest.key[:KEY_LENGTH]}, {took}"))
            cells = [Text.assemble((f"{name} ", "dim"), figure(value)) for name, value in artifact.metrics.items()]
            console.print(Padding(Columns(cells, padding=(0, 2), equal=True, column_first=True), (0, 0, 0, 2)))
        return
    (artifact,) = found.artifacts.values()
    manifest, ingredients = artifact.manifest, artifact.ingredients
    inputs = ingredients.get("inputs", {})
    usual, own = flattened(Recipe(name="default").model_dump(mode="json")), flattened(ingredients.get("recipe", {}))
    unusual = [f"{path}: {shown(value)}" for path, value in own.items() if path not in usual or usual[path] != value]
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    rows = {
        "stage": f"{manifest.stage}, version {manifest.version}",
        "key": manifest.key,
        "made": f"{ago(manifest.made)} by recipe {manifest.recipe} on {manifest.host}",
        "took": f"{duration(manifest.seconds)} in {manifest.attempts} attempt(s) with {manifest.workers} worker(s)",
        "reads": "\n".join(f"{name} (content {digest[:KEY_LENGTH]})" for name, digest in inputs.items()),
        "metrics": "\n".join(f"{name} {figure(value, 6)}" for name, value in artifact.metrics.items()),
        "files": "\n".join(
            f"{name} ({decimal(record.size)}{', not published' if name in manifest.omitted else ''})"
            for name, record in manifest.files.items()
        ),
        "versions": ", ".join(f"{name} {version}" for name, version in manifest.versions.items()),
        "recipe": "\n".join([*unusual, "all else is default"]),
    }
    for name, text in rows.items():
        if text:
            grid.add_row(Text(name, style="bold"), Text(text))
    console.print(grid)
    folder = named_folder(store.runs, manifest.recipe, manifest.stage, artifact.folder)
    tell(console, f"folder  {shown_path(folder)}")


def _data(artifact: Artifact) -> dict[str, Any]:
    """An artifact for other programs."""
    manifest = artifact.manifest
    own = {"stage", "key", "version", "recipe", "made", "seconds", "attempts", "workers", "host", "versions"}
    return {
        **manifest.model_dump(include=own),
        "content": manifest.digest,
        "folder": shown_path(artifact.folder),
        "published": artifact.published,
        "bytes": artifact.size,
        "files": {name: record.size for name, record in manifest.files.items() if name not in manifest.omitted},
        "metrics": artifact.metrics,
    }
