"""A command that trains says what is missing where only the controller's packages are installed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

LEAN = """
import importlib.util
from iowbc.commands import options
known = importlib.util.find_spec
options.find_spec = lambda name: None if name in {"torch", "mujoco", "mlflow"} else known(name)
from iowbc.cli import main
main()
"""
"""The command line as it is without three of the packages."""


def lean(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", LEAN, *words]
    settings = {**os.environ, "COLUMNS": "200"}
    return subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("words", [["run", "smoke"], ["play", "smoke"], ["bench", "sim"], ["ui"]])
def test_what_is_missing_is_said_in_one_sentence(tmp_path: Path, words: list[str]) -> None:
    done = lean(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"`iowbc {words[0]}` needs mlflow, mujoco, torch" in done.stderr
    assert "`pip install '.[train]'` in a checkout brings them" in done.stderr
    assert not (tmp_path / "runs").exists()


def test_a_plan_needs_nothing_that_trains(tmp_path: Path) -> None:
    done = lean(tmp_path, "plan", "smoke")
    assert done.returncode == 0, done.stderr
    assert "nothing stored yet" in done.stdout
