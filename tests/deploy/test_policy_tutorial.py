"""The tutorial that takes a policy home, with an exported folder and without what trains."""

import subprocess
import sys
from pathlib import Path

from pages import write


def test_take_a_policy_home(exported: Path, tmp_path: Path) -> None:
    write("tutorials/policy.md", tmp_path)
    words = [sys.executable, "-W", "error", "walk.py", str(exported)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "29 joints" in done.stdout
