"""What a recipe asks of its robot is checked before anything runs, with the line."""

from pathlib import Path

import pytest

from iowbc.commands.request import prepared
from iowbc.errors import RecipeError
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.runs import Runs
from iowbc.recipe.reading.loading import load_recipe

ELBOW = "rg:\n  sampling:\n    joint_ranges:\n      {name}: {{low: {low}, high: 1.0}}\n"


def check(folder: Path, text: str) -> None:
    file = folder / "mine.yaml"
    file.write_text(text)
    prepared(load_recipe(file), Runs(folder / "runs"), Options())


def test_arm_joints_within_their_limits_pass(tmp_path: Path) -> None:
    check(tmp_path, ELBOW.format(name="left_elbow_joint", low=0.0))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ELBOW.format(name="left_elbw_joint", low=0.0), r"mine.yaml:4:\d+: .* is no joint of g1.*'left_elbow_joint'\?"),
        (ELBOW.format(name="left_knee_joint", low=0.0), r"mine.yaml:4:\d+: .* is no arm joint of g1; valid: left_"),
        (
            ELBOW.format(name="left_elbow_joint", low=-9.0),
            r"mine.yaml:4:\d+: .* -9 to 1: the joint's limits are",
        ),
        (
            "rg: {sampling: {height: {low: 50, high: 80}}}\n",
            r"mine.yaml:1:\d+: key 'rg.sampling.height': 50 to 80: .* m",
        ),
    ],
)
def test_what_the_robot_does_not_have_is_named_with_its_line(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(RecipeError, match=expected):
        check(tmp_path, text)
