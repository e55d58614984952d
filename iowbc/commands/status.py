"""`iowbc status`: what runs, what was left unfinished, and what the recipes have."""

from rich.console import Console
from rich.text import Text

from iowbc.commands.named import known_recipes, last_used
from iowbc.commands.results import shown_path
from iowbc.commands.tables import plain_table
from iowbc.pipeline.console.wording import KEY_LENGTH, ago, duration
from iowbc.pipeline.store.last_used import recall
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.pipeline.tracking.tracker import backlog


def print_status(store: Store, console: Console) -> None:
    """What runs, what was left unfinished, what the recipes have, and what MLflow lacks."""
    going_on = unfinished(store.runs)
    if going_on:
        table = plain_table("stage", "recipe", "key", "state", "at", "spent", "attempt")
        for folder, record in going_on:
            who = holder(store.runs, folder.name)
            state = f"runs, {who}" if who else f"stopped {ago(float(record.get('updated', 0.0)))}"
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
        table = plain_table("recipe", "finished stages", "last")
        for recipe in recipes:
            stages = recall(store.runs, recipe).get("stages", {})
            last = max((float(use["time"]) for use in stages.values()), default=0.0)
            table.add_row(recipe, ", ".join(last_used(store, recipe)), ago(last))
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
