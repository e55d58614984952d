"""`iowbc status`: what runs, what was left unfinished, and what the recipes have."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from iowbc.commands.lookup import known_recipes, last_used
from iowbc.commands.printed import plain_table, print_json, shown_path, tell
from iowbc.pipeline.console.live_table import sparkline
from iowbc.pipeline.console.wording import KEY_LENGTH, ago, duration
from iowbc.pipeline.store.last_used import recall
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.pipeline.tracking.delivery import DAMAGED_LINE
from iowbc.pipeline.tracking.tracker import backlog


def print_status(store: Store, console: Console, as_json: bool = False) -> None:
    """What runs, what was left unfinished, what the recipes have, and what MLflow lacks."""
    going_on = unfinished(store.runs)
    stopped: list[str] = []
    if as_json:
        print_json(console, _data(store))
        return
    for folder, record in going_on:
        _print_work(store, console, folder, record)
        if not holder(store.runs, folder.name) and record.get("command"):
            stopped.append(str(record["command"]))
    for command in dict.fromkeys(stopped):
        tell(console, f"to go on: {command}")
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
    aside = sorted(store.runs.damaged.glob(f"{DAMAGED_LINE}*"))
    if aside:
        console.print(
            f"{len(aside)} damaged lines of MLflow's journals were put aside, as {shown_path(aside[-1])}",
            highlight=False,
        )
    waiting = backlog(store.runs)
    if waiting:
        console.print(
            f"MLflow lacks something of {len(waiting)} runs; the next run sends it "
            f"(its log: {shown_path(store.runs.tracking / 'sender.log')})",
            highlight=False,
        )


def _print_work(store: Store, console: Console, folder: Path, record: Mapping[str, Any]) -> None:
    """A stage that is being made, or was left unfinished: who works on it, how far it is, and its small curve."""
    who = holder(store.runs, folder.name)
    state = ("runs", "bold yellow") if who else (f"stopped {ago(float(record.get('updated', 0.0)))}", "magenta")
    title = f" of {record.get('recipe', '?')} ({folder.name[:KEY_LENGTH]}): "
    by = f", {who}" if who else ""
    console.print(Text.assemble((str(record.get("stage", "?")), "bold"), title, state, by))
    total = float(record.get("total", 0.0))
    share = [f"{100 * float(record.get('done', 0.0)) / total:.0f} %"] if total else []
    spent = f"{duration(float(record.get('seconds', 0.0)))} spent"
    note = [str(record["note"])] if record.get("note") else []
    attempt = f"attempt {record.get('attempts', '?')}"
    console.print(Padding(Text(", ".join([*share, spent, attempt, *note])), (0, 0, 0, 2)))
    values = [value for _, value in record.get("curve", [])]
    if values:
        text = f"{record.get('metric')} {sparkline(values)} {values[-1]:.4g}"
        console.print(Padding(Text(text), (0, 0, 0, 2)))


def _data(store: Store) -> dict[str, Any]:
    """The same for other programs."""
    working = [
        {
            "stage": record.get("stage"),
            "recipe": record.get("recipe"),
            "key": folder.name,
            "holder": asdict(who) if (who := holder(store.runs, folder.name)) else None,
            **{name: record.get(name) for name in ("done", "total", "seconds", "attempts", "updated", "note")},
        }
        for folder, record in unfinished(store.runs)
    ]
    recipes = {name: recall(store.runs, name).get("stages", {}) for name in known_recipes(store)}
    return {"unfinished": working, "recipes": recipes, "unsent": len(backlog(store.runs))}
