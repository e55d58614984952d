"""`iowbc ls`: the stored artifacts."""

from rich.console import Console
from rich.text import Text

from iowbc.commands.lookup import known_recipes
from iowbc.commands.printed import NARROW, artifact_data, plain_table, print_json
from iowbc.commands.results import metrics_text
from iowbc.errors import require_known
from iowbc.pipeline.console.wording import KEY_LENGTH, ago, duration, size
from iowbc.pipeline.store.last_used import ever_used
from iowbc.pipeline.store.store import Store
from iowbc.recipe.recipe import PIPELINE

METRICS_SHOWN = 2
"""Metrics of an artifact in its row; `show` has all."""


def list_artifacts(store: Store, console: Console, stage: str | None, as_json: bool = False) -> None:
    """A row for each artifact, oldest first. Raises `UsageError` for an unknown stage."""
    if stage is not None:
        require_known(stage, "stage", PIPELINE)
    users: dict[str, list[str]] = {}
    for recipe in known_recipes(store):
        for key in ever_used(store.runs, recipe):
            users.setdefault(key, []).append(recipe)
    if as_json:
        found = [artifact_data(artifact) for artifact in store.artifacts(stage)]
        print_json(console, [data | {"used_by": users.get(data["key"], [])} for data in found])
        return
    wide = console.width >= NARROW
    table = plain_table("stage", "key", "used by", "made", "took", "size", *(["metrics"] if wide else []))
    artifacts = store.artifacts(stage)
    for artifact in artifacts:
        manifest = artifact.manifest
        table.add_row(
            manifest.stage,
            manifest.key[:KEY_LENGTH],
            ", ".join(users.get(manifest.key, [f"{manifest.recipe} (published)" if artifact.published else "-"])),
            ago(manifest.made),
            duration(manifest.seconds),
            size(artifact.size),
            *([Text(metrics_text(artifact, METRICS_SHOWN))] if wide else []),
        )
    if artifacts:
        console.print(table)
    else:
        console.print(f"nothing is stored in {store.runs.store} yet; `iowbc run RECIPE` makes it", highlight=False)
