"""The robot is symmetric, and the mirror maps say how."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from pinocchio_states import configuration

from iowbc.robot.description import Robot, load_robot
from iowbc.robot.mirror import (
    AXIAL_SIGN,
    QUATERNION_SIGN,
    VECTOR_SIGN,
    MirrorMap,
    interaction_mirror,
    joint_mirror,
    support_mirror,
)

ROBOT_IS_SYMMETRIC = 5e-4
"""The manufacturer's left and right differ by fractions of a millimetre and of a gram [m]."""


@pytest.mark.parametrize("make", [joint_mirror, support_mirror, interaction_mirror])
def test_mirroring_twice_changes_nothing(robot: Robot, make: Any) -> None:
    mirror: MirrorMap = make(robot)
    values = np.random.default_rng(0).normal(size=(7, len(mirror.sign)))
    np.testing.assert_array_equal(mirror(mirror(values)), values)
    assert not np.array_equal(mirror(values), values)


def test_branches_are_mirrored_as_in_the_whole_body(robot: Robot) -> None:
    values = np.random.default_rng(0).normal(size=len(robot.joints))
    whole = joint_mirror(robot)(values)
    np.testing.assert_array_equal(support_mirror(robot)(values[robot.support]), whole[robot.support])
    np.testing.assert_array_equal(interaction_mirror(robot)(values[robot.interaction]), whole[robot.interaction])


def test_a_left_joint_becomes_its_right_counterpart(robot: Robot) -> None:
    mirror = joint_mirror(robot)
    names = [robot.joints[place] for place in mirror.permutation]
    swapped = {"left": "right", "right": "left"}
    for name, other in zip(robot.joints, names, strict=True):
        side, _, rest = name.partition("_")
        assert other == (f"{swapped[side]}_{rest}" if side in swapped else name)
    for name, sign in zip(robot.joints, mirror.sign, strict=True):
        assert sign == (1.0 if "pitch" in name or "knee" in name or "elbow" in name else -1.0)


def test_axes_of_opposite_directions_change_the_sign(robot: Robot, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(robot.folder, tmp_path / "other"))
    text = (folder / "g1.xml").read_text()
    joint = re.search(r'<joint name="right_hip_yaw_joint"[^>]*axis="0 0 1"', text)
    assert joint is not None
    (folder / "g1.xml").write_text(text.replace(joint[0], joint[0].replace('axis="0 0 1"', 'axis="0 0 -1"')))
    changed = joint_mirror(load_robot(folder)).sign != joint_mirror(robot).sign
    assert [name for name, other in zip(robot.joints, changed, strict=True) if other] == [
        "left_hip_yaw_joint",
        "right_hip_yaw_joint",
    ]


def test_limits_gains_and_default_posture_are_symmetric(robot: Robot) -> None:
    mirror = joint_mirror(robot)
    np.testing.assert_allclose(mirror(robot.default_position), robot.default_position)
    low, high = mirror(robot.lower), mirror(robot.upper)
    np.testing.assert_allclose(np.minimum(low, high), robot.lower)
    np.testing.assert_allclose(np.maximum(low, high), robot.upper)
    for values in (robot.kp, robot.kd, robot.effort, robot.armature, robot.velocity_limit):
        np.testing.assert_array_equal(values[mirror.permutation], values)
    np.testing.assert_array_equal(robot.action_scale[support_mirror(robot).permutation], robot.action_scale)


def test_kinematics_commute_with_the_mirror(robot: Robot, pinocchio_model: Any, postures: list[Any]) -> None:
    model, data, image = pinocchio_model, pinocchio_model.createData(), pinocchio_model.createData()
    mirror = joint_mirror(robot)
    frames = [(model.getFrameId(left), model.getFrameId(right)) for left, right in (robot.soles, robot.wrists)]
    for position, quaternion, joints in postures:
        q = configuration(position, quaternion, joints)
        mirrored = configuration(VECTOR_SIGN * position, QUATERNION_SIGN * quaternion, mirror(joints))
        com, com_image = pinocchio.centerOfMass(model, data, q), pinocchio.centerOfMass(model, image, mirrored)
        np.testing.assert_allclose(com_image, VECTOR_SIGN * com, atol=ROBOT_IS_SYMMETRIC)
        pinocchio.updateFramePlacements(model, data)
        pinocchio.updateFramePlacements(model, image)
        for left, right in frames:
            expected = VECTOR_SIGN * data.oMf[left].translation
            np.testing.assert_allclose(image.oMf[right].translation, expected, atol=ROBOT_IS_SYMMETRIC)


def test_gravity_torques_commute_with_the_mirror(robot: Robot, pinocchio_model: Any, postures: list[Any]) -> None:
    model, data = pinocchio_model, pinocchio_model.createData()
    mirror = joint_mirror(robot)
    for _, quaternion, joints in postures[:20]:
        gravity = pinocchio.computeGeneralizedGravity(
            model, data, configuration(np.zeros(3), quaternion, joints)
        ).copy()
        image = configuration(np.zeros(3), QUATERNION_SIGN * quaternion, mirror(joints))
        mirrored = pinocchio.computeGeneralizedGravity(model, data, image)
        np.testing.assert_allclose(mirrored[:3], VECTOR_SIGN * gravity[:3], atol=1e-6)
        np.testing.assert_allclose(mirrored[3:6], AXIAL_SIGN * gravity[3:6], atol=0.05)
        np.testing.assert_allclose(mirrored[6:], mirror(gravity[6:]), atol=0.05)
