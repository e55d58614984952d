"""Which sampling ranges a robot allows: one rule for recipes that are loaded and for the stage."""

import re
from typing import Any

import pytest

from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.ranges import straight_height, wrong_ranges
from iowbc.robot.description import Robot


def test_the_default_ranges_fit_the_g1(robot: Robot) -> None:
    assert not list(wrong_ranges(robot, ReferenceGenerator()))


def test_the_straight_legged_g1_is_as_high_as_its_maker_says(robot: Robot) -> None:
    assert straight_height(robot) == pytest.approx(0.792, abs=1e-3)


@pytest.mark.parametrize(
    ("sampling", "path", "text"),
    [
        (
            {"joint_ranges": {"left_elbow": {"low": 0, "high": 1}}},
            "rg.sampling.joint_ranges.left_elbow",
            "is no joint of g1; valid: .*; did you mean 'left_elbow_joint'",
        ),
        (
            {"joint_ranges": {"left_knee_joint": {"low": 0, "high": 1}}},
            "rg.sampling.joint_ranges.left_knee_joint",
            "is no arm joint of g1; valid: left_shoulder",
        ),
        (
            {"joint_ranges": {"left_elbow_joint": {"low": 0, "high": 4}}},
            "rg.sampling.joint_ranges.left_elbow_joint",
            r"0 to 4: the joint's limits are -1\.047 to 2\.094 rad",
        ),
        ({"height": {"low": 0.5, "high": 1.4}}, "rg.sampling.height", r"0\.5 to 1\.4: .*valid: 0\.24 to 0\.87 m"),
        ({"height": {"low": 0.05, "high": 0.7}}, "rg.sampling.height", r"0\.05 to 0\.7: .*valid: 0\.24 to 0\.87 m"),
        ({"pitch": {"low": -2.0, "high": 0.0}}, "rg.sampling.pitch", r"-2 to 0: valid is within ±1\.57"),
    ],
)
def test_a_range_beyond_the_robot_is_named_with_what_is_valid(
    robot: Robot, sampling: dict[str, Any], path: str, text: str
) -> None:
    (found,) = wrong_ranges(robot, ReferenceGenerator.model_validate({"sampling": sampling}))
    assert found[0] == path
    assert re.search(text, found[1]), found[1]
