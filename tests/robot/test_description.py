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


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('angle="radian" ', "", 'give <compiler angle="radian"/>'),
        ("<compiler ", '<compiler settotalmass="50" ', "settotalmass='50'> of 'the model' is not read"),
        ('<body name="torso_link" ', '<body name="torso_link" euler="0 0 1" ', "euler='0 0 1'> of 'torso_link'"),
        ('<joint name="left_knee_joint" ', '<joint name="left_knee_joint" pos="0 0 1" ', "of 'left_knee_joint'"),
    ],
)
def test_a_model_that_would_be_read_differently_from_mujoco_is_refused(
    folder: Path, old: str, new: str, told: str
) -> None:
    path = folder / "g1.xml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=re.escape(told)):
        load_robot(folder)


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


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("robot.yaml", "linkages:", "linkage:", r"unknown entry linkage; valid: name, .*, linkages"),
        (
            "robot.yaml",
            "kp: 200, kd: 5.0, velocity: 20",
            "kp: -200, kd: 5.0, velocity: 20",
            r"joints\.knee\.kp: is -200",
        ),
        (
            "robot.yaml",
            "{kp: 200, kd: 5.0, velocity: 20",
            "{kp: 200, kd: 5.0, velocity: 0",
            r"knee\.velocity: is 0, exp",
        ),
        (
            "robot.yaml",
            "{kp: 50, kd: 2.0",
            "{kp: stiff, kd: 2.0",
            r"joints\.ankle_pitch\.kp: is 'stiff', expected a pos",
        ),
        (
            "robot.yaml",
            "[left_sole, right_sole]",
            "[right_sole, left_sole]",
            r"soles: the left one is moved by right_hip_p",
        ),
        ("robot.yaml", "[left_grip, right_grip]", "[left_grip, left_grip]", r"wrists: .* the right one by left_should"),
        (
            "robot.yaml",
            "  - left_knee_joint\n",
            "",
            r"support: legs and waist .* outside of it are left_knee_joint, left_should",
        ),
        ("g1.xml", 'class="foot" pos', 'class="visual" pos', r"soles: left_ankle_roll_link needs a geom of class foot"),
        ("g1.xml", "<freejoint", "<site", r"g1\.xml: expected a <freejoint>"),
        ("g1.xml", "</mujoco>", "<actuator/></mujoco>", r"g1\.xml: expected .* no <actuator>"),
        (
            "g1.xml",
            '<joint name="left_knee_joint"',
            '<joint name="left_knee_joint" type="slide"',
            r"expected one hinge",
        ),
        (
            "g1.xml",
            '<joint name="left_knee_joint" axis="0 1 0"',
            '<joint name="left_knee_joint" axis="0 0 0"',
            r"has the axis '0",
        ),
        ("g1.xml", "</worldbody>", '<geom type="plane" size="1 1 1"/></worldbody>', r"g1\.xml: a <geom> of the world"),
        ("g1.xml", 'armature="', 'armature="x', r"g1\.xml: <joint armature='x0.*expected 1 finite number"),
        ("g1.xml", 'armature="', 'armature="-', r"has the armature '-0.*an inertia of 0 or more"),
        ("g1.xml", 'mass="', 'mass="-', r"body 'pelvis': has the mass -"),
        (
            "g1.xml",
            ' range="',
            ' range="-180 180" name2="',
            r"has the range '-180 180', expected two angles in radians",
        ),
        ("g1.xml", ' actuatorfrcrange="', ' actuatorfrcrange="0 0" name2="', r"expected a largest torque above 0"),
        ("g1.xml", ' size="0.07"', "", r"<geom size=''> of 'pelvis': expected 1 finite number"),
        ("robot.yaml", "linkages:", "linkages:\nold:", r"unknown entry old"),
    ],
)
def test_what_no_stage_could_use_is_refused(folder: Path, file: str, old: str, new: str, message: str) -> None:
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=message):
        load_robot(folder)


def test_joints_without_a_side_in_their_name_are_refused(folder: Path) -> None:
    """The mirror maps pair left and right by name; joints named otherwise would be their own mirror images."""
    path = folder / "g1.xml"
    path.write_text(path.read_text().replace('"right_knee_joint"', '"right_shin_joint"'))
    path = folder / "robot.yaml"
    text = path.read_text().replace("right_knee_joint", "right_shin_joint")
    path.write_text(text + "  shin: {kp: 200, kd: 5.0, velocity: 20, default: 0.74, scale: 0.20}\n")
    with pytest.raises(
        ValueError, match=r"soles: .*right_shin_joint.* expected the same joints on both sides, named left"
    ):
        load_robot(folder)


def test_a_damaged_mjcf_is_named(folder: Path) -> None:
    (folder / "g1.xml").write_text("<mujoco><worldbody>")
    with pytest.raises(ValueError, match=r"g1\.xml: not well-formed XML"):
        load_robot(folder)
