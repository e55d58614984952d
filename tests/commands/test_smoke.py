"""The smoke recipe runs from its name to its end: all six stages, at the smallest size."""

import subprocess
import sys
from pathlib import Path

import pytest
from network_watch import watched

from iowbc import open_artifact
from iowbc.recipe.recipe import PIPELINE


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_smoke_recipe_runs_in_an_empty_folder_and_is_cached_afterwards(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "iowbc", "run", "smoke", "--set", "execution.track=false"]
    with watched(tmp_path / "watch") as watch:
        made = subprocess.run(words, cwd=tmp_path, env=watch.environment, capture_output=True, text=True, check=False)
        assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
        assert watch.contacts() == [], "no process of a run tells anybody"
    for stage in PIPELINE:
        assert open_artifact(f"smoke/{stage}", tmp_path / "runs").metrics
    exported = open_artifact("smoke/export", tmp_path / "runs").folder
    assert {"policy.onnx", "contract.json", "golden.npz"} <= {path.name for path in exported.iterdir()}
    again = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert again.stdout.count(": cached") == len(PIPELINE)
