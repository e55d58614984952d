"""Results of a run: films, chosen metrics, tables, the next commands."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from rich.console import Console
from rich.text import Text

from iowbc.commands.lookup import last_used, policy_stages
from iowbc.commands.printed import shown_path, tell
from iowbc.deploy.exported_folder import STEP
from iowbc.pipeline.console.wording import KEY_LENGTH, figure
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import named_folder, recall
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.results.table import Table, drawn, read_tables
from iowbc.stages.registry import STAGES

METRICS_SHOWN = 3
"""Maximum number of metrics shown per stage."""
TABLES = (
    *("lifting", "pushing", "paper", "heavy", "compliance", "impedance", "push_map"),
    *("capacity", "interquartile", "trainings", "probe"),
)
"""The main tables, in their order."""
DRAWN = ("lifting", "pushing", "heavy", "trainings", "probe")
"""Those that are drawn at the end of a run; the others are named."""
TRIALS, PROBE = "trials.parquet", "probe.parquet"


def print_results(runs: Runs, recipe: str, artifacts: Mapping[str, Artifact], console: Console) -> None:
    folders = {
        stage: named_folder(runs, recipe, stage, artifact.folder).absolute() for stage, artifact in artifacts.items()
    }
    for folder in folders.values():
        for film in sorted((folder / "videos").glob("*")):
            tell(console, f"film  {shown_path(film)}")
    for stage, artifact in artifacts.items():
        if chosen := ", ".join(f"{name} {figure(value)}" for name, value in headline(stage, artifact.metrics)):
            console.print(Text(f"{stage:<10}  {chosen}"), no_wrap=True, overflow="ellipsis")
    for stage, artifact in artifacts.items():
        _print_tables(artifact, folders[stage] / "tables", console)
    for folder in folders.values():
        if pictures := len(list((folder / "figures").glob("*"))):
            tell(console, f"figures  {shown_path(folder / 'figures')} ({pictures})")
        if (folder / STEP).is_file():
            tell(console, f"controller  {shown_path(folder)}")
    if artifacts:
        tell(console, "next:")
        for command in next_commands(runs, recipe, artifacts):
            tell(console, f"  {command}")


def headline(stage: str, metrics: Mapping[str, float]) -> list[tuple[str, float]]:
    """The few metrics that tell most of a stage: by its patterns, else the first ones."""
    patterns = STAGES[stage].headline if stage in STAGES else ()
    chosen = [name for pattern in patterns for name in metrics if fnmatchcase(name, pattern)]
    return [(name, metrics[name]) for name in (chosen or list(metrics))[:METRICS_SHOWN]]


def main_tables(folders: Iterable[Path]) -> str:
    """The main tables in the folders of artifacts or of a comparison, in Markdown."""
    found = [path for folder in folders for path in (folder / "tables").glob("*.md")]
    chosen = sorted((path for path in found if path.stem in TABLES), key=lambda path: _rank(path.stem))
    return "\n".join(path.read_text(encoding="utf-8", errors="replace") for path in chosen)


def next_commands(runs: Runs, recipe: str, artifacts: Mapping[str, Artifact]) -> list[str]:
    """Suggested commands: to watch the robot, if there is a policy, and to read about the run; with the keys of a run
    with overrides, unless one sets the name: a recipe's name stands for its artifacts without overrides."""
    overrides = recall(runs, recipe).overrides
    lasting = not overrides or any(override.startswith("name=") for override in overrides)
    own = last_used(Store(runs), recipe) if lasting else {}
    others = {
        stage: artifact.manifest.key[:KEY_LENGTH]
        for stage, artifact in artifacts.items()
        if stage not in own or own[stage].manifest.key != artifact.manifest.key
    }
    policy = next((stage for stage in policy_stages() if stage in artifacts), None)
    seen = [["iowbc", "play", others.get(policy, recipe)]] if policy else [] if others else [["iowbc", "show", recipe]]
    read = ["iowbc", "show", [*others.values()][-1]] if others else ["iowbc", "report", recipe]
    return [shlex.join([*words, *runs.option]) for words in (*seen, read)]


def _print_tables(artifact: Artifact, folder: Path, console: Console) -> None:
    shown = {table.name: table for table in read_tables(artifact.folder / "tables") if table.name in DRAWN}
    for name in sorted(shown, key=DRAWN.index):
        console.print()
        console.print(drawn(shown[name], console.width))
    others = [
        path.name for path in sorted(folder.glob("*.md"), key=lambda path: _rank(path.stem)) if path.stem not in shown
    ]
    if others:
        tell(console, f"more tables  {shown_path(folder)}: {', '.join(others)}")


def split_tables(tables: Sequence[Table]) -> tuple[list[Table], list[Table]]:
    """The main tables in their order, and the others."""
    ranked = sorted(tables, key=lambda table: _rank(table.name))
    return [one for one in ranked if one.name in TABLES], [one for one in ranked if one.name not in TABLES]


def _rank(name: str) -> tuple[int, str]:
    return TABLES.index(name) if name in TABLES else len(TABLES), name
