"""The tutorial that takes a policy home, with the controllers that come with the repository."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from pages import write

ROOT = Path(__file__).parents[2]
PUBLISHED = sorted(graph.parent for graph in (ROOT / "runs" / "published" / "export").glob("*/step.onnx"))


@pytest.mark.parametrize("policy", PUBLISHED, ids=lambda folder: folder.name[:8])
def test_take_a_policy_home(policy: Path, tmp_path: Path) -> None:
    write("tutorials/policy.md", tmp_path)
    words = [sys.executable, "-W", "error", "walk.py", str(policy)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "29 joints, held back: False" in done.stdout


@pytest.mark.parametrize("policy", PUBLISHED, ids=lambda folder: folder.name[:8])
def test_it_stands_in_plain_mujoco(policy: Path) -> None:
    stand = runpy.run_path(str(ROOT / "examples" / "plain_mujoco.py"))["stand"]
    assert stand(policy) > 0.65
