"""The path of a recipe in docs/architecture.md is that of a run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TRACED = """
import os, sys
from iowbc.stages.registry import STAGES

ends = {stage.run.__code__ for stage in STAGES.values()}
root, entered, seen = sys.argv[1], [], []

def room(code):
    name = os.path.relpath(code.co_filename, root)
    helps = ("/tracking/", "/console/", "digests", "pipeline/code", "pipeline/nested")
    counts = name.startswith(("cli.py", "commands/", "pipeline/")) and not any(part in name for part in helps)
    return counts and not code.co_name.startswith("<")

def watch(frame, event, argument):
    code = frame.f_code
    if event == "call" and code in ends:
        print(*(one.co_qualname.split(".")[-1] for one in seen if one in entered))
        sys.stdout.flush()
        os._exit(0)
    if event == "call" and room(code) and (seen or code.co_qualname == "run"):
        caller = frame.f_back
        while caller and (not caller.f_code.co_filename.startswith(root) or caller.f_code.co_name.startswith("<")):
            caller = caller.f_back
        seen.extend([code] if code not in seen else [])
        entered.extend([caller.f_code] if caller else [])

from iowbc.cli import main
sys.setprofile(watch)
main(["run", "recipes/quickstart.yaml", "--quiet", "--set", "execution.track=false", "--runs", sys.argv[2]])
"""


@pytest.mark.integration
def test_the_documented_path_of_a_recipe_is_complete_and_short(tmp_path: Path) -> None:
    words = [sys.executable, "-c", TRACED, str(ROOT / "iowbc"), str(tmp_path)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    section = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").split("## Path of a")[1]
    rows = [row.split("|")[2] for row in section.splitlines() if row.startswith("| `iowbc/")]
    told = {name for row in rows for name in re.findall(r"`(?:\w+\.)?(_?[a-z_]+)`", row)}
    entered = done.stdout.split()
    assert len(entered) + len(["load_recipe"]) <= 24
    assert set(entered) <= told, "docs/architecture.md lacks functions"
