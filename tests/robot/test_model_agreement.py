"""MuJoCo, pinocchio, the package's own tree and the public URDF describe the same robot."""

from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest
from pinocchio_states import configuration

from iowbc.control.arms import ArmKinematics
from iowbc.robot.description import Robot

SAME_FILE, PUBLIC = 1e-9, 1e-5
MASS = 33.341142
"""Of the 29-joint G1, revision 1.0 [kg]."""


def place(model: Any, data: Any, posture: tuple[Any, Any, Any]) -> None:
    data.qpos[:3], data.qpos[3:7], data.qpos[7:] = posture
    mujoco.mj_fwdPosition(model, data)


def bodies(model: Any) -> list[str]:
    return [model.body(index).name for index in range(1, model.nbody)]


def test_the_robot_weighs_what_the_manufacturer_says(mujoco_model: Any, pinocchio_model: Any) -> None:
    assert mujoco_model.body_mass.sum() == pytest.approx(MASS, abs=1e-6)
    assert pinocchio.computeTotalMass(pinocchio_model) == pytest.approx(MASS, abs=1e-6)


def test_pinocchio_and_mujoco_agree_on_kinematics_and_centre_of_mass(
    mujoco_model: Any, pinocchio_model: Any, postures: list[Any]
) -> None:
    model, data = pinocchio_model, pinocchio_model.createData()
    simulated = mujoco.MjData(mujoco_model)
    frames = [model.getFrameId(name) for name in bodies(mujoco_model)]
    for posture in postures:
        place(mujoco_model, simulated, posture)
        q = configuration(*posture)
        pinocchio.framesForwardKinematics(model, data, q)
        found = np.array([data.oMf[frame].translation for frame in frames])
        turned = np.array([data.oMf[frame].rotation for frame in frames])
        np.testing.assert_allclose(found, simulated.xpos[1:], atol=SAME_FILE)
        np.testing.assert_allclose(turned, simulated.xmat[1:].reshape(-1, 3, 3), atol=SAME_FILE)
        np.testing.assert_allclose(pinocchio.centerOfMass(model, data, q), simulated.subtree_com[1], atol=SAME_FILE)


def test_pinocchio_and_mujoco_agree_on_mass_matrix_and_gravity(
    mujoco_model: Any, pinocchio_model: Any, postures: list[Any]
) -> None:
    model, data = pinocchio_model, pinocchio_model.createData()
    simulated = mujoco.MjData(mujoco_model)
    dense = np.zeros((mujoco_model.nv, mujoco_model.nv))
    for position, quaternion, joints in postures:
        place(mujoco_model, simulated, (position, quaternion, joints))
        mujoco.mj_fullM(mujoco_model, simulated, dense)
        q = configuration(position, quaternion, joints)
        mass = pinocchio.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        to_world = np.eye(mujoco_model.nv)  # pinocchio's base velocity is in the base's frame, MuJoCo's in the world's
        to_world[:3, :3] = simulated.xmat[1].reshape(3, 3)
        np.testing.assert_allclose(mass, to_world.T @ dense @ to_world, atol=SAME_FILE)
        mujoco.mj_fwdVelocity(mujoco_model, simulated)
        gravity = pinocchio.computeGeneralizedGravity(model, data, q)
        np.testing.assert_allclose(gravity, to_world.T @ simulated.qfrc_bias, atol=1e-8)


def test_the_public_urdf_agrees(robot: Robot, pinocchio_model: Any, postures: list[Any]) -> None:
    loaders = pytest.importorskip("example_robot_data.robots_loader")
    public = loaders.load("g1").model
    data, public_data = pinocchio_model.createData(), public.createData()
    assert pinocchio.computeTotalMass(public) == pytest.approx(MASS, abs=1e-5)
    places = [public.joints[public.getJointId(name)].idx_q for name in robot.joints]
    speeds = [public.joints[public.getJointId(name)].idx_v for name in robot.joints]
    order = np.concatenate([np.arange(6), speeds])
    names = [body for body in robot.tree.bodies if public.existFrame(body)]
    assert len(names) == len(robot.tree.bodies)
    for posture in postures:
        q = configuration(*posture)
        public_q = np.empty(public.nq)
        public_q[:7] = q[:7]
        public_q[places] = q[7:]
        pinocchio.framesForwardKinematics(pinocchio_model, data, q)
        pinocchio.framesForwardKinematics(public, public_data, public_q)
        for name in names:
            ours, theirs = data.oMf[pinocchio_model.getFrameId(name)], public_data.oMf[public.getFrameId(name)]
            np.testing.assert_allclose(ours.translation, theirs.translation, atol=PUBLIC)
            np.testing.assert_allclose(ours.rotation, theirs.rotation, atol=PUBLIC)
        com = pinocchio.centerOfMass(pinocchio_model, data, q)
        np.testing.assert_allclose(com, pinocchio.centerOfMass(public, public_data, public_q), atol=PUBLIC)
        mass = pinocchio.crba(pinocchio_model, data, q) - np.diag(pinocchio_model.armature)
        public_mass = (pinocchio.crba(public, public_data, public_q) - np.diag(public.armature))[np.ix_(order, order)]
        lower = np.maximum(order[:, None], 0) <= order[None, :]
        np.testing.assert_allclose(np.triu(mass)[lower], np.triu(public_mass)[lower], atol=PUBLIC * mass.max())


def test_the_models_have_motors_and_limits_of_the_description(
    robot: Robot, mujoco_model: Any, pinocchio_model: Any
) -> None:
    np.testing.assert_array_equal(pinocchio_model.armature[6:], robot.armature)
    np.testing.assert_array_equal(mujoco_model.dof_armature[6:], robot.armature)
    np.testing.assert_array_equal(mujoco_model.jnt_range[1:], np.stack([robot.lower, robot.upper], axis=1))
    np.testing.assert_array_equal(mujoco_model.jnt_actfrcrange[1:, 1], robot.effort)
    np.testing.assert_array_equal(pinocchio_model.upperEffortLimit[6:], robot.effort)
    assert (pinocchio_model.upperPositionLimit[:3] > 5.0).all()


def test_the_default_posture_stands_on_flat_soles(robot: Robot, mujoco_model: Any) -> None:
    data = mujoco.MjData(mujoco_model)
    place(
        mujoco_model,
        data,
        (np.array([0.0, 0.0, robot.default_height]), np.array([1.0, 0, 0, 0]), robot.default_position),
    )
    for site in robot.soles:
        assert data.site(site).xpos[2] == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(data.site(site).xmat.reshape(3, 3), np.eye(3), atol=1e-9)
    feet = [index for index in range(mujoco_model.ngeom) if "_foot_" in mujoco_model.geom(index).name]
    np.testing.assert_allclose(data.geom_xpos[feet, 2] - mujoco_model.geom_size[feet, 0], 0.0, atol=1e-9)


def test_arm_and_waist_kinematics_agree_with_pinocchio(robot: Robot, pinocchio_model: Any, postures: list[Any]) -> None:
    model, data = pinocchio_model, pinocchio_model.createData()
    arms = ArmKinematics(robot)
    joints = np.array([posture[2] for posture in postures])
    wrists, jacobian = arms.forward(joints[:, robot.interaction])
    pitch = np.linspace(-0.5, 1.0, len(joints))
    roll = np.linspace(0.3, -0.3, len(joints))
    waist = joints[:, robot.support[12:]]
    rotation, position = arms.torso_in_heading(waist, pitch, roll)
    level, at = arms.torso_in_heading(waist, pitch)
    back = arms.into_torso(waist, pitch, wrists @ np.swapaxes(level, 1, 2) + at[:, None])
    np.testing.assert_allclose(back, wrists, atol=SAME_FILE)
    columns = 6 + robot.interaction.reshape(2, 7)
    for row in range(len(joints)):
        quaternion = pinocchio.Quaternion(pinocchio.rpy.rpyToMatrix(roll[row], pitch[row], 0.0)).coeffs()
        q = np.concatenate([np.zeros(3), quaternion, joints[row]])
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        torso = data.oMf[model.getFrameId(robot.torso)]
        np.testing.assert_allclose(torso.translation, position[row], atol=SAME_FILE)
        np.testing.assert_allclose(torso.rotation, rotation[row], atol=SAME_FILE)
        for side, site in enumerate(robot.wrists):
            frame = model.getFrameId(site)
            np.testing.assert_allclose(torso.actInv(data.oMf[frame].translation), wrists[row, side], atol=SAME_FILE)
            world = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)[:3]
            in_torso = torso.rotation.T @ world[:, columns[side]]
            np.testing.assert_allclose(in_torso, jacobian[row, side], atol=SAME_FILE)
