"""Plans and differences read well on 80 characters, and numbers as people write them."""

import io
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from iowbc.commands.diff import diff
from iowbc.commands.tables import hanging
from iowbc.pipeline.console.wording import figure
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

Command = Callable[..., "subprocess.CompletedProcess[str]"]
WIDTH = 80


def test_a_difference_is_drawn_on_a_terminal_stage_by_stage(folder: Path, command: Command) -> None:
    (folder / "third.yaml").write_text("extends: first.yaml\nseed: 4\n")
    assert command("run", "third.yaml", "--until", "rg-fit").returncode == 0
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, color_system=None, width=WIDTH)
    diff(Store(Runs(folder / "runs")), console, "first", "third")
    lines = written.getvalue().splitlines()
    assert all(len(line) <= WIDTH for line in lines)
    assert ["seed", "3", "4"] in [line.split() for line in lines]
    assert lines.index("recipe") < lines.index("rg-dataset") < lines.index("rg-fit")
    (reads,) = [line.split() for line in lines if "input rg-dataset" in line]
    assert [len(digest) for digest in reads[2:]] == [12, 12], "a digest is shown by its first characters"


def test_what_does_not_fit_stands_further_to_the_right() -> None:
    line = "eval.lifting.masses (recipes/full.yaml:13:14): [0.0, 2.0, 4.0] -> [0.0, 1.0]"
    assert hanging(line, 60, 4).splitlines() == [
        "    eval.lifting.masses (recipes/full.yaml:13:14): [0.0,",
        "      2.0, 4.0] -> [0.0, 1.0]",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2402304.0, "2,402,304"),
        (0.0, "0"),
        (1107.47, "1,107"),
        (0.123456, "0.1235"),
        (1e15, "1e+15"),
        (float("nan"), "nan"),
        (-2.5, "-2.5"),
    ],
)
def test_a_whole_number_is_written_out(value: float, text: str) -> None:
    assert figure(value) == text


def test_a_change_has_its_sign() -> None:
    assert (figure(6.0, 3, "+"), figure(-2398208.0, 3, "+"), figure(0.01764, 3, "+")) == ("+6", "-2,398,208", "+0.0176")
