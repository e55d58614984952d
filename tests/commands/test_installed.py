"""What an installed package has beside its modules, as the wheel is told to lay it out."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_a_package_installed_elsewhere_brings_recipes_and_a_robot(tmp_path: Path) -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    site, folder = tmp_path / "site", tmp_path / "mine"
    for package in wheel["packages"]:
        shutil.copytree(ROOT / package, site / package, ignore=shutil.ignore_patterns("__pycache__"))
    for source, target in wheel["force-include"].items():
        shutil.copytree(ROOT / source, site / target)
    settings = os.environ | {"PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}

    def iowbc(*words: str) -> str:
        command = [sys.executable, "-m", "iowbc", *words]
        done = subprocess.run(command, cwd=tmp_path, env=settings, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "rg-dataset" in iowbc("plan", "quickstart")
    iowbc("init", str(folder))
    assert {path.name for path in ROOT.glob("recipes/*.yaml")} <= {path.name for path in folder.rglob("*.yaml")}
    assert (folder / "robots" / "g1" / "robot.yaml").is_file()
