"""A folder where the small stages have run, for the commands that look at it."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

SMALL_STAGES = Path(__file__).parents[1] / "pipeline" / "fake_stages.py"
Command = Callable[..., "subprocess.CompletedProcess[str]"]


def run(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """The command line on the small stages."""
    words = [sys.executable, str(SMALL_STAGES), *arguments]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recipes `first` and `second`, which differ in the teacher's steps, have run."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "first.yaml").write_text("seed: 3\nteacher:\n  steps: 4096\nexecution: {track: false}\n")
    (folder / "second.yaml").write_text("extends: first.yaml\nteacher:\n  steps: 8192\n")
    for name in ("first.yaml", "second.yaml"):
        assert run(folder, "run", name).returncode == 0
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    """A copy that a test may change."""
    return Path(shutil.copytree(finished, tmp_path / "copy", symlinks=True))


@pytest.fixture
def command(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs a command in the copy and returns it finished."""
    monkeypatch.setenv("COLUMNS", "200")
    return lambda *arguments: run(folder, *arguments)


@pytest.fixture
def key(folder: Path) -> Callable[[str, str], str]:
    """The key of a recipe's stage."""

    def find(recipe: str, stage: str) -> str:
        record = json.loads((folder / "runs" / "recipes" / f"{recipe}.json").read_text())
        return str(record["stages"][stage]["key"])

    return find
