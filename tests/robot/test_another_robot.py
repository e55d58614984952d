"""Another robot is another folder: a G1 of 23 joints, with stiff bodies in waist and wrists."""

from typing import Any

import mujoco
import numpy as np
import pytest

from iowbc.control.arms import ArmKinematics
from iowbc.control.legs import leg_joints
from iowbc.control.observation import observation_layout
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.recipe.task.joint_references import References
from iowbc.robot.description import Robot
from iowbc.robot.mirror import joint_mirror

KINDS = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def test_its_branches_are_those_of_its_folder(robot_of_23: Robot) -> None:
    robot = robot_of_23
    assert (len(robot.joints), len(robot.support), len(robot.interaction)) == (23, 13, 10)
    assert [robot.joints[robot.support[place]] for place in robot.waist] == ["waist_yaw_joint"]
    assert len(robot.waist_pitch) == 0
    assert robot.wrist_bodies == ("left_wrist_roll_link", "right_wrist_roll_link")
    names = [[robot.joints[robot.support[place]] for place in leg] for leg in leg_joints(robot)]
    assert names == [[f"{side}_{kind}_joint" for kind in KINDS] for side in ("left", "right")]
    mirror = joint_mirror(robot)
    values = np.random.default_rng(0).normal(size=23)
    assert np.array_equal(mirror(mirror(values)), values)


def test_its_arms_and_their_weight_are_those_of_the_simulator(robot_of_23: Robot) -> None:
    robot, arms = robot_of_23, ArmKinematics(robot_of_23)
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    data = mujoco.MjData(model)
    torso = data.body(robot.tree.mover(robot.torso).name)
    for joints in np.random.default_rng(0).uniform(robot.lower, robot.upper, (10, 23)):
        data.qpos[:] = np.concatenate([np.zeros(3), UPRIGHT, joints])
        mujoco.mj_forward(model, data)
        wrists, _ = arms.forward(joints[None, robot.interaction])
        for side, site in enumerate(robot.wrists):
            seen = torso.xmat.reshape(3, 3).T @ (data.site(site).xpos - torso.xpos)
            assert wrists[0, side] == pytest.approx(seen, abs=1e-9)
        torque = arms.torque(
            joints[None, robot.interaction], joints[None, robot.support[robot.waist]], np.array([[0.0, 0.0, -1.0]])
        )
        assert torque[0] == pytest.approx(data.qfrc_bias[6:][robot.interaction], abs=1e-6)


def test_its_observation_is_shorter(robot: Robot, robot_of_23: Robot) -> None:
    longer, layout = observation_layout(robot, True), observation_layout(robot_of_23, True)
    assert longer.size - layout.size == 2 * 6 + 2 * 2 + 4
    assert layout.slices["last_action"].stop - layout.slices["last_action"].start == 13


def test_its_wrists_go_where_a_command_says(robot_of_23: Robot) -> None:
    layer = ReferenceLayer(robot_of_23, References(), None)
    command: Any = np.zeros((1, 11))
    command[0, 3] = robot_of_23.default_height
    grasp = both_wrists(References().grasps.free)[None]
    arms, support = layer.start(command, grasp)
    assert (arms.shape, support.shape) == ((1, 10), (1, 13))
    for _ in range(100):
        arms, support = layer.advance(arms, support, command, grasp, 0.02)
    rotation, position = layer.arms.torso_in_heading(support[:, layer.waist], layer.pelvis_pitch(support, command))
    wrists = (layer.arms.forward(arms)[0] @ np.swapaxes(rotation, 1, 2) + position[:, None])[0]
    assert wrists == pytest.approx(grasp[0], abs=0.01)
