"""What the tests of the pipeline share."""

from pathlib import Path

import pytest
from workplace import RECIPE, Workplace


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    robot = tmp_path / "robots" / "g1"
    robot.mkdir(parents=True)
    (robot / "robot.yaml").write_text("name: g1\n")
    (tmp_path / "small.yaml").write_text(RECIPE)
    return Workplace(tmp_path)
