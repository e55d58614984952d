"""Reading a robot's folder, and what is said where it is wrong."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from iowbc.errors import UsageError
from iowbc.robot.description import Robot, load_robot, robot_folder


@pytest.fixture
def folder(robot: Robot, tmp_path: Path) -> Path:
    return Path(shutil.copytree(robot.folder, tmp_path / "g1"))


def change(folder: Path, key: str, value: object) -> None:
    path = folder / "robot.yaml"
    entries = yaml.safe_load(path.read_text())
    entries[key] = value
    path.write_text(yaml.safe_dump(entries))


def test_branches_cover_the_joints_in_the_papers_order(robot: Robot) -> None:
    assert len(robot.joints) == 29
    np.testing.assert_array_equal(robot.support, np.arange(15))
    np.testing.assert_array_equal(robot.interaction, np.arange(15, 29))
    legs = [joint.removeprefix("left_").removesuffix("_joint") for joint in robot.joints[:6]]
    assert legs == ["hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"]
    assert [joint.removesuffix("_joint") for joint in robot.joints[12:15]] == ["waist_yaw", "waist_roll", "waist_pitch"]


def test_an_unknown_robot_is_answered_with_the_known_ones() -> None:
    with pytest.raises(UsageError, match=r"no robot 'g2'.*known robots: g1"):
        robot_folder("g2")


def test_a_missing_entry_is_named(folder: Path) -> None:
    path = folder / "robot.yaml"
    entries = yaml.safe_load(path.read_text())
    del entries["soles"]
    path.write_text(yaml.safe_dump(entries))
    with pytest.raises(ValueError, match=r"robot\.yaml: missing soles"):
        load_robot(folder)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("torso", "chest", r"torso: no body 'chest'.*torso_link"),
        ("soles", ["left_sole", "right_foot"], r"no site 'right_foot'.*right_sole"),
        ("support", ["left_hip_pitch_joint", "tail"], r"unknown or repeated joints \['tail'\]"),
        ("wrists", "left_grip", r"wrists: expected \[left, right\]"),
    ],
)
def test_a_wrong_name_is_answered_with_the_valid_ones(folder: Path, key: str, value: object, message: str) -> None:
    change(folder, key, value)
    with pytest.raises(ValueError, match=message):
        load_robot(folder)


def test_a_default_outside_its_range_is_refused(folder: Path) -> None:
    path = folder / "robot.yaml"
    path.write_text(re.sub(r"(knee:.*default:) +[0-9.]+", r"\1 6.0", path.read_text()))
    with pytest.raises(ValueError, match=r"default position 6\.0 of left_knee_joint is outside its range"):
        load_robot(folder)


def test_an_unknown_column_of_a_joint_is_refused(folder: Path) -> None:
    path = folder / "robot.yaml"
    path.write_text(re.sub(r"(knee:.*)velocity:", r"\1velocty:", path.read_text()))
    with pytest.raises(ValueError, match=r"joints\.knee: unknown \['velocty'\], missing \['velocity'\]"):
        load_robot(folder)


def test_a_damaged_mjcf_is_named(folder: Path) -> None:
    (folder / "g1.xml").write_text("<mujoco><worldbody>")
    with pytest.raises(ValueError, match=r"g1\.xml: not well-formed XML"):
        load_robot(folder)
