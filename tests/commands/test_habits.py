"""What one expects of any command line: a version, completion, JSON for programs, silence when asked."""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import iowbc
from iowbc.cli import BENCHMARKS, COMMANDS, app
from iowbc.commands import completion

ROOT = Path(__file__).parents[2]
Command = Callable[..., "subprocess.CompletedProcess[str]"]


def test_the_version_is_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    newest = re.search(r"^## (\S+?),? ", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert project["version"] == iowbc.__version__ == newest.group(1)


def test_the_version_is_told(command: Command) -> None:
    assert command("--version").stdout.startswith("iowbc 0.")


@pytest.mark.parametrize(
    ("words", "part", "expected"),
    [
        (["plan", "first.yaml", "--set", "seed=9"], lambda data: len(data[0]["stages"]), 6),
        (["status"], lambda data: sorted(data["recipes"]), ["first", "second"]),
        (["ls", "teacher"], lambda data: sorted(one["used_by"] for one in data), [["first"], ["second"]]),
        (["show", "first/teacher"], lambda data: data[0]["metrics"], {"count": 3.0}),
        (["show", "first"], lambda data: data["recipe"]["seed"], 3),
        (["diff", "first", "second"], lambda data: data["differences"][1], "teacher.steps: 4096 -> 8192"),
        (["compare", "first", "second"], lambda data: data["metrics"][0]["run"], "first"),
    ],
)
def test_what_is_told_can_be_read_by_programs(
    command: Command, words: list[str], part: Callable[[object], object], expected: object
) -> None:
    done = command(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert part(json.loads(done.stdout)) == expected


@pytest.mark.parametrize("words", [["status", "--runs"], ["ls", "--runs"], ["init"]])
def test_a_folder_with_brackets_is_printed_as_it_is_named(command: Command, words: list[str]) -> None:
    assert "a[b]c" in command(*words, "a[b]c").stdout.splitlines()[-1]


def test_a_quiet_run_prints_nothing_and_a_verbose_one_every_step(command: Command) -> None:
    assert command("run", "first.yaml", "-q").stdout == ""
    assert "eval: 33 %" in command("run", "first.yaml", "-v", "--set", "eval.trials=9").stdout
    failed = command("run", "first.yaml", "-q", "--set", "seed=x")
    assert failed.stderr
    assert failed.stdout == ""


def test_a_shell_completes_recipes_artifacts_stages_and_paths(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.delenv("IOWBC_RUNS", raising=False)
    assert "quickstart" in completion.recipes("quick")
    assert completion.ran("") == ["first", "second"]
    assert completion.artifacts("first/t") == ["first/teacher"]
    key = (folder / "runs" / "first" / "teacher").resolve().name
    assert completion.artifacts(key[:12]) == [key]
    assert completion.stages("t") == ["teacher"]
    assert completion.paths("teacher.gam") == ["teacher.gamma="]


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("iowbc run --until tea", "teacher"),
        ("iowbc play second/tea", "second/teacher"),
        ("iowbc doc", "doctor"),
        ("iowbc bench tr", "train"),
        ("iowbc bench sim --env", "--environments"),
        ("iowbc run quick", "quickstart"),
    ],
)
def test_the_command_line_answers_a_shells_question(folder: Path, line: str, answer: str) -> None:
    place = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" ")), "IOWBC_RUNS": "runs"}
    asked = {**os.environ, "_IOWBC_COMPLETE": "complete_bash", **place}
    words = [sys.executable, "-m", "iowbc"]
    done = subprocess.run(words, env=asked, cwd=folder, capture_output=True, text=True, check=False)
    assert done.stdout.split() == [answer]


def test_the_list_of_commands_is_printed_before_any_of_them_is_imported() -> None:
    program = (
        "import sys\nfrom iowbc.cli import app\n"
        "try:\n    app(['--help'])\n"
        "finally:\n    print(*(name for name in sys.modules if name.startswith('iowbc.commands.')))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert [line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ")][-20:] == [*COMMANDS, "bench"]
    assert done.stdout.splitlines()[-1] == "iowbc.commands.process"


@pytest.mark.parametrize("words", [*COMMANDS, *(f"bench {name}" for name in BENCHMARKS)])
def test_every_command_that_is_listed_says_what_it_takes(words: str) -> None:
    done = CliRunner().invoke(app, [*words.split(), "--help"])
    assert done.exit_code == 0, done.output
    assert f"{words} [OPTIONS]" in done.output
