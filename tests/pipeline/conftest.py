"""What the tests of the pipeline share."""

import shutil
from pathlib import Path

import pytest
from workplace import RECIPE, Workplace

from iowbc.robot.description import robot_folder


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    shutil.copytree(robot_folder("g1"), tmp_path / "robots" / "g1")
    (tmp_path / "small.yaml").write_text(RECIPE)
    return Workplace(tmp_path)
