"""`iowbc ls`, `iowbc status` and `iowbc show`: what is stored, what is going on, and one artifact in detail."""

import time
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from iowbc.commands.named import known_recipes, last_used, named
from iowbc.commands.results import shown_files, shown_path
from iowbc.errors import shown
from iowbc.pipeline.console.wording import KEY_LENGTH, duration, size
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.last_used import recall
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.store import Artifact, Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.pipeline.tracking.tracker import backlog
from iowbc.recipe.recipe import Recipe


def list_artifacts(store: Store, console: Console, stage: str | None) -> None:
    """A row for each artifact, oldest first."""
    users: dict[str, list[str]] = {}
    for recipe in known_recipes(store):
        for artifact in last_used(store, recipe).values():
            users.setdefault(artifact.manifest.key, []).append(recipe)
    table = _table("stage", "key", "used by", "made", "took", "size", "metrics")
    artifacts = store.artifacts(stage)
    for artifact in artifacts:
        manifest = artifact.manifest
        table.add_row(
            manifest.stage,
            manifest.key[:KEY_LENGTH],
            ", ".join(users.get(manifest.key, ["-"])),
            _ago(manifest.made),
            duration(manifest.seconds),
            size(artifact.size),
            Text(metrics_text(artifact, 3)),
        )
    if artifacts:
        console.print(table)
    else:
        console.print(f"nothing is stored in {store.runs.store} yet; `iowbc run RECIPE` makes it", highlight=False)


def print_status(store: Store, console: Console) -> None:
    """What runs, what was left unfinished, what the recipes have, and what MLflow lacks."""
    going_on = unfinished(store.runs)
    if going_on:
        table = _table("stage", "recipe", "key", "state", "at", "spent", "attempt")
        for folder, record in going_on:
            who = holder(store.runs, folder.name)
            state = f"runs, {who}" if who else f"stopped {_ago(float(record.get('updated', 0.0)))}"
            total = float(record.get("total", 0.0))
            share = f"{100 * float(record.get('done', 0.0)) / total:.0f} % {record.get('note', '')}" if total else ""
            table.add_row(
                str(record.get("stage", "?")),
                str(record.get("recipe", "?")),
                folder.name[:KEY_LENGTH],
                state,
                Text(share),
                duration(float(record.get("seconds", 0.0))),
                str(record.get("attempts", "?")),
            )
        console.print(table)
    recipes = known_recipes(store)
    if recipes:
        table = _table("recipe", "finished stages", "last")
        for recipe in recipes:
            stages = recall(store.runs, recipe).get("stages", {})
            last = max((float(use["time"]) for use in stages.values()), default=0.0)
            table.add_row(recipe, ", ".join(last_used(store, recipe)), _ago(last))
        console.print(table)
    if not (going_on or recipes):
        console.print(f"nothing has run in {store.runs.root} yet; `iowbc run RECIPE` starts", highlight=False)
    waiting = backlog(store.runs)
    if waiting:
        console.print(
            f"MLflow lacks something of {len(waiting)} runs; the next run sends it "
            f"(its log: {shown_path(store.runs.tracking / 'sender.log')})",
            highlight=False,
        )


def show(store: Store, console: Console, word: str) -> None:
    """All of one artifact, or the stages and metrics of a recipe."""
    found = named(store, word)
    if found.recipe is not None:
        table = _table("stage", "key", "made", "took", "metrics")
        for stage, artifact in found.artifacts.items():
            manifest = artifact.manifest
            row = (stage, manifest.key[:KEY_LENGTH], _ago(manifest.made), duration(manifest.seconds))
            table.add_row(*row, Text(metrics_text(artifact)))
        console.print(table)
        return
    (artifact,) = found.artifacts.values()
    _show_artifact(artifact, console)


def _show_artifact(artifact: Artifact, console: Console) -> None:
    manifest, ingredients = artifact.manifest, artifact.ingredients
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    rows = {
        "stage": f"{manifest.stage}, version {manifest.version}",
        "key": manifest.key,
        "folder": shown_path(artifact.folder),
        "made": f"{_ago(manifest.made)} by recipe {manifest.recipe} on {manifest.host}",
        "took": f"{duration(manifest.seconds)} in {manifest.attempts} attempt(s) with {manifest.workers} worker(s)",
        "reads": "\n".join(f"{name} (content {digest[:KEY_LENGTH]})" for name, digest in _inputs(ingredients).items()),
        "metrics": "\n".join(f"{name} {value:.6g}" for name, value in artifact.metrics.items()),
        "files": "\n".join(f"{name} ({size(record.size)})" for name, record in manifest.files.items()),
        "versions": ", ".join(f"{name} {version}" for name, version in manifest.versions.items()),
        "recipe": "\n".join(_unusual(ingredients.get("recipe", {}))),
        "to look at": "\n".join(shown_files(artifact)),
    }
    for name, text in rows.items():
        if text:
            grid.add_row(Text(name, style="bold"), Text(text))
    console.print(grid, soft_wrap=True)


def _unusual(slices: Mapping[str, Any]) -> list[str]:
    """The values of a stage's part of the recipe that are not the defaults."""
    usual = flattened(Recipe(name="default").model_dump(mode="json"))
    own = flattened(slices)
    found = [f"{path}: {shown(value)}" for path, value in own.items() if path not in usual or usual[path] != value]
    return [*found, "all else is default"]


def _inputs(ingredients: dict[str, object]) -> dict[str, str]:
    inputs = ingredients.get("inputs")
    return {str(name): str(digest) for name, digest in inputs.items()} if isinstance(inputs, dict) else {}


def metrics_text(artifact: Artifact, limit: int | None = None) -> str:
    """The metrics of an artifact in one line, or the first few."""
    items = list(artifact.metrics.items())
    text = ", ".join(f"{name} {value:.4g}" for name, value in items[:limit])
    return text + (", ..." if limit is not None and len(items) > limit else "")


def _ago(moment: float) -> str:
    return f"{duration(max(0.0, time.time() - moment))} ago" if moment else ""


def _table(*columns: str) -> Table:
    table = Table(box=None, padding=(0, 1))
    for name in columns:
        table.add_column(name, no_wrap=name not in ("metrics", "finished stages"), overflow="fold")
    return table
