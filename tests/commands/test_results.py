"""The end of a run: films first, a few metrics, tables that fit, and what to type next."""

import io
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from iowbc.commands.lookup import last_used
from iowbc.commands.results import headline, next_commands, print_results
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.results.table import Column, MeanCell, Table, drawn, heads, markdown, read_tables, write_table

PUBLISHED = Path(__file__).parents[2] / "runs" / "published"
LIFTING = Table(
    "lifting",
    "Command tracking errors under lifting: means over surviving trials with their 95 % interval.",
    heads(
        *("Mass", "Algorithm", Column("E_α", "rad"), Column("E_h", "m"), "Survived"), Column("paper E_α", role="paper")
    ),
    [
        ("0 kg", "IO-WBC", MeanCell("0.039", "0.024"), MeanCell("0.02", "1.2e-03"), "5/5", "0.125"),
        ("0 kg", "stands still", "0.047", "0.017", "–", "–"),
    ],
    pd.DataFrame(),
)


def shown(width: int, make: Callable[[Console], object]) -> str:
    console = Console(width=width, file=io.StringIO())
    with console.capture() as capture:
        make(console)
    return capture.get()


def on_screen(width: int) -> str:
    return shown(width, lambda console: console.print(drawn(LIFTING, console.width)))


def test_a_table_that_was_stored_is_drawn_as_it_was_made(tmp_path: Path) -> None:
    write_table(LIFTING, tmp_path)
    (table,) = read_tables(tmp_path)
    text = shown(100, lambda console: console.print(drawn(table, console.width)))
    assert text == on_screen(100)
    assert text.splitlines()[0] == "Command tracking errors under lifting"
    assert "0.039 ± 0.024" in text
    assert text.count("0 kg") == 1, "the first column groups rows that repeat it"


def test_a_bar_in_a_cell_does_not_end_it_in_markdown() -> None:
    table = Table("one", "", heads("Algorithm"), [("with | without",)])
    assert markdown(table).splitlines()[2] == r"| with \| without |"


@pytest.mark.parametrize(
    ("width", "head", "intervals"),
    [
        (82, "Mass  Algorithm         E_α [rad]         E_h [m]  Survived  paper E_α", True),
        (70, "Mass  Algorithm         E_α [rad]         E_h [m]  Survived", True),
        (50, "Mass  Algorithm     E_α [rad]  E_h [m]  Survived", False),
        (42, "Mass  Algorithm     E_α [rad]  E_h [m]", False),
    ],
)
def test_a_narrow_terminal_leaves_out_the_papers_figures_then_intervals_then_columns(
    width: int, head: str, intervals: bool
) -> None:
    lines = on_screen(width).splitlines()
    assert all(len(line) <= width for line in lines)
    assert lines[1].rstrip() == head
    assert ("±" in lines[2]) == intervals
    assert ("paper E_α" in lines[-1]) == (width < 82)


def test_a_few_metrics_of_a_stage_are_chosen() -> None:
    metrics = {"step": 1.0, "reward": 2.0, "best_score": 0.9, "episode_seconds": 12.0}
    assert headline("teacher", metrics) == [("best_score", 0.9), ("episode_seconds", 12.0)]
    assert headline("teacher", {"count": 3.0}) == [("count", 3.0)]


def test_the_end_of_a_run_is_short_names_links_and_the_next_commands(folder: Path) -> None:
    runs = Runs(folder / "runs")
    artifacts = last_used(Store(runs), "first")
    films = runs.root / "first" / "eval" / "videos"
    films.mkdir()
    (films / "box.mp4").write_bytes(b"")
    write_table(LIFTING, films.parent / "tables")
    lines = shown(82, lambda console: print_results(runs, "first", artifacts, console)).splitlines()
    assert lines[0].startswith("film  ")
    assert lines[0].endswith("runs/first/eval/videos/box.mp4")
    metrics = [line.split() for line in lines[1:7]]
    assert [(line[0], line[1:]) for line in metrics] == [(stage, ["count", "3"]) for stage in artifacts]
    assert not any(artifact.manifest.key in line for artifact in artifacts.values() for line in lines)
    assert "Command tracking errors under lifting" in lines
    commands = lines[lines.index("next:") + 1 :]
    assert [command.split()[:3] for command in commands] == [
        ["iowbc", "play", "first"],
        ["iowbc", "report", "first"],
    ]
    assert len(lines) < 35


def only_tables(folder: str, names: list[str]) -> list[str]:
    """All but the tables of an evaluation."""
    return [] if Path(folder).name == "tables" else [name for name in names if name != "tables"]


def test_the_end_of_the_largest_run_fits_a_screen_of_80_columns(folder: Path) -> None:
    runs = Runs(folder / "runs")
    artifacts = last_used(Store(runs), "first")
    tables = max((PUBLISHED / "eval").glob("*/tables"), key=lambda path: (path / "pushing.md").stat().st_size)
    shutil.copytree(tables.parent, runs.root / "first" / "eval", ignore=only_tables, dirs_exist_ok=True)
    lines = shown(80, lambda console: print_results(runs, "first", artifacts, console)).splitlines()
    assert len(lines) < 70
    assert "Success in the heavy tasks" in lines
    assert max(len(line) for line in lines if str(runs.root) not in line) <= 80
    heads = [line.split() for line in lines if line.startswith("Mass")]
    assert len(heads) == 2
    assert all({"E_α", "E_h", "E_v", "E_ψ", "Survived"} <= set(head) for head in heads)
    assert any(line.startswith("more tables") and "paper.md" in line for line in lines)


def test_what_a_run_with_overrides_made_goes_by_its_key_in_a_new_store_too(
    command: "Callable[..., subprocess.CompletedProcess[str]]", folder: Path
) -> None:
    lines = command("run", "first.yaml", "--set", "eval.trials=2", "--runs", "new").stdout.splitlines()
    made = {path.parent.name: path.name for path in (folder / "new" / "store").glob("*/*")}
    assert lines[lines.index("next:") + 1] == f"  iowbc play {made['export'][:12]} --runs new"
    named = ("--set", "name=own", "--set", "eval.trials=2", "--runs", "new")
    assert "  iowbc play own --runs new" in command("run", "first.yaml", *named).stdout.splitlines()


def test_what_a_run_with_overrides_made_lies_under_a_short_path(
    command: "Callable[..., subprocess.CompletedProcess[str]]", folder: Path
) -> None:
    text = command("run", "first.yaml", "--set", "eval.trials=2").stdout
    (figures,) = [line.split()[1] for line in text.splitlines() if line.startswith("figures") and "eval-" in line]
    assert len(figures) < 50
    assert json.loads((folder / figures).with_name("result.json").read_text())["count"] == 3
    assert not re.search("[0-9a-f]{64}", text)


def test_what_a_run_with_overrides_made_goes_by_its_key(folder: Path) -> None:
    runs = Runs(folder / "runs")
    other = last_used(Store(runs), "second")  # another teacher, from which the same student comes
    key = other["teacher"].manifest.key[:12]
    for stages, played in ((("teacher", "distill"), "first"), (("teacher",), key)):
        made = {stage: other[stage] for stage in stages}
        play, show = next_commands(runs, "first", made)
        assert play.split()[:3] == ["iowbc", "play", played]
        assert show.split()[:3] == ["iowbc", "show", key]
