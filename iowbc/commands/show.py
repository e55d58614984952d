"""`iowbc show`: one artifact in detail, or the stages and metrics of a recipe."""

from collections.abc import Mapping
from typing import Any

from rich.columns import Columns
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from iowbc.commands.lookup import named
from iowbc.commands.printed import artifact_data, print_json, shown_path, tell
from iowbc.errors import shown
from iowbc.pipeline.console.wording import KEY_LENGTH, ago, duration, figure, size
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.links import named_folder
from iowbc.pipeline.store.store import Store
from iowbc.recipe.recipe import Recipe


def show(store: Store, console: Console, word: str, as_json: bool = False) -> None:
    """All of one artifact, or the stages and metrics of a recipe."""
    found = named(store, word)
    if as_json:
        artifacts = [
            artifact_data(artifact) | {"ingredients": artifact.ingredients} for artifact in found.artifacts.values()
        ]
        print_json(console, artifacts if found.recipe is None else {"recipe": found.recipe, "stages": artifacts})
        return
    if found.recipe is not None:
        for stage, artifact in found.artifacts.items():
            manifest = artifact.manifest
            took = f"made {ago(manifest.made)}, took {duration(manifest.seconds)}"
            console.print(Text.assemble((stage, "bold"), f" {manifest.key[:KEY_LENGTH]}, {took}"))
            cells = [Text.assemble((f"{name} ", "dim"), figure(value)) for name, value in artifact.metrics.items()]
            console.print(Padding(Columns(cells, padding=(0, 2), equal=True, column_first=True), (0, 0, 0, 2)))
        return
    (artifact,) = found.artifacts.values()
    _show_artifact(store, artifact, console)


def _show_artifact(store: Store, artifact: Artifact, console: Console) -> None:
    manifest, ingredients = artifact.manifest, artifact.ingredients
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    rows = {
        "stage": f"{manifest.stage}, version {manifest.version}",
        "key": manifest.key,
        "made": f"{ago(manifest.made)} by recipe {manifest.recipe} on {manifest.host}",
        "took": f"{duration(manifest.seconds)} in {manifest.attempts} attempt(s) with {manifest.workers} worker(s)",
        "reads": "\n".join(f"{name} (content {digest[:KEY_LENGTH]})" for name, digest in _inputs(ingredients).items()),
        "metrics": "\n".join(f"{name} {figure(value, 6)}" for name, value in artifact.metrics.items()),
        "files": "\n".join(f"{name} ({size(record.size)})" for name, record in manifest.files.items()),
        "versions": ", ".join(f"{name} {version}" for name, version in manifest.versions.items()),
        "recipe": "\n".join(_unusual(ingredients.get("recipe", {}))),
    }
    for name, text in rows.items():
        if text:
            grid.add_row(Text(name, style="bold"), Text(text))
    console.print(grid)
    folder = named_folder(store.runs, manifest.recipe, manifest.stage, artifact.folder)
    tell(console, f"folder  {shown_path(folder)}")


def _unusual(slices: Mapping[str, Any]) -> list[str]:
    """The values of a stage's part of the recipe that are not the defaults."""
    usual = flattened(Recipe(name="default").model_dump(mode="json"))
    own = flattened(slices)
    found = [f"{path}: {shown(value)}" for path, value in own.items() if path not in usual or usual[path] != value]
    return [*found, "all else is default"]


def _inputs(ingredients: dict[str, object]) -> dict[str, str]:
    inputs = ingredients.get("inputs")
    return {str(name): str(digest) for name, digest in inputs.items()} if isinstance(inputs, dict) else {}
