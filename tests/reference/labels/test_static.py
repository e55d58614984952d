"""Static labels: equilibrium by MuJoCo's inverse dynamics, symmetry, optimality, limits."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest

from iowbc.errors import Rejected
from iowbc.pipeline.stage import Job
from iowbc.recipe.generator import PostureProblem, ReferenceGenerator
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel, ground_forces
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror, support_mirror

LABELS = 40


@pytest.fixture(scope="module")
def method(support: SupportModel) -> StaticMethod:
    return StaticMethod(support)


def sole_forces(model: Any, data: Any, robot: Robot, wrench: Any) -> Any:
    """Generalised forces of wrenches in the sole sites' frames, (nv,)."""
    forces = np.zeros(model.nv)
    for site, values in zip(robot.soles, wrench, strict=True):
        turn = data.site(site).xmat.reshape(3, 3)
        body = model.site(site).bodyid[0]
        mujoco.mj_applyFT(model, data, turn @ values[:3], turn @ values[3:], data.site(site).xpos, body, forces)
    return forces


def test_mujocos_inverse_dynamics_gives_the_labels_torques(robot: Robot, dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    torque_error, base_error = [], []
    for row in np.linspace(0, len(dataset) - 1, LABELS).astype(int):
        data.qpos[:3], data.qpos[3:7] = dataset.base_position[row], dataset.base_quaternion[row]
        data.qpos[7 + robot.support], data.qpos[7 + robot.interaction] = dataset.support[row], dataset.arm[row]
        data.qvel[:], data.qacc[:] = 0.0, 0.0
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse - sole_forces(model, data, robot, dataset.wrench[row])
        torque_error.append(np.abs(needed[6 + robot.support] - dataset.torque[row]).max())
        base_error.append(np.abs(needed[:6]).max())
    assert np.median(torque_error) < 1.0
    assert np.max(torque_error) < 1.0
    assert np.max(base_error) < 1.0


def test_feet_height_and_torso_are_where_they_were_asked(
    method: StaticMethod, support: SupportModel, command: Callable[..., Sample]
) -> None:
    for height, pitch in ((0.70, 0.0), (0.55, 0.4), (0.68, 1.0), (0.66, -0.3)):
        posture = method.solve(command(height, pitch))
        data = support.data
        pinocchio.framesForwardKinematics(support.model, data, posture.configuration)
        for sole, place in zip(support.soles, support.stance, strict=True):
            assert np.linalg.norm(pinocchio.log6(place.actInv(data.oMf[sole])).vector) < 1e-3
        assert data.oMf[support.base].translation[2] == pytest.approx(height, abs=2e-3)
        assert pinocchio.rpy.matrixToRpy(data.oMf[support.torso].rotation)[1] == pytest.approx(pitch, abs=5e-3)


def test_the_com_height_reading_puts_the_centre_of_mass_there(
    support: SupportModel, command: Callable[..., Sample]
) -> None:
    support = SupportModel(support.robot, support.problem, "com")
    posture = StaticMethod(support).solve(command(0.6, 0.1))
    com = pinocchio.centerOfMass(support.model, support.data, posture.configuration)
    assert com[2] == pytest.approx(0.6, abs=2e-3)


def test_arms_stretched_forward_move_the_body_back(method: StaticMethod, command: Callable[..., Sample]) -> None:
    carrying = command(0.68, 0.2)
    stretched = carrying.arm.copy()
    stretched[[3, 10]] -= 0.5  # elbows
    stretched[[0, 7]] -= 0.5  # shoulder pitch
    posture, far = method.solve(carrying), method.solve(Sample(stretched, carrying.command))
    assert far.configuration[0] < posture.configuration[0] - 0.005
    assert far.wrench[:, 2].sum() == pytest.approx(posture.wrench[:, 2].sum(), rel=1e-6)


def test_a_mirrored_sample_has_the_mirrored_label(robot: Robot, method: StaticMethod, carrying: Any) -> None:
    arms, legs = interaction_mirror(robot), support_mirror(robot)
    uneven = carrying.copy()
    uneven[:7] += 0.2
    original = method.solve(Sample(uneven, np.array([0.65, 0.3])))
    image = method.solve(Sample(arms(uneven), np.array([0.65, 0.3])))
    np.testing.assert_allclose(image.support, legs(original.support), atol=2e-3)


def cost(method: StaticMethod, support: SupportModel, sample: Sample, posture: Posture) -> float:
    """The objective, written out by hand."""
    problem, q = support.problem, posture.configuration
    com = pinocchio.centerOfMass(support.model, support.data, q).copy()
    pinocchio.framesForwardKinematics(support.model, support.data, q)
    height = support.data.oMf[support.base].translation[2]
    turn = pinocchio.log3(sample.torso_rotation().T @ support.data.oMf[support.torso].rotation)
    forces = ground_forces(support.model, support.soles, posture.wrench)
    torque = pinocchio.computeStaticTorque(support.model, support.data, q, forces)[6:]
    rest = support.robot.default_position[support.robot.support]
    return float(
        problem.com_weight * (com[:2] @ com[:2])
        + problem.height_weight * (height - sample.height) ** 2
        + problem.torso_weight * (turn @ turn)
        + problem.torque_weight * (torque @ torque)
        + support.posture_weights @ (q[7:] - rest) ** 2
    )


def test_no_neighbour_that_is_in_equilibrium_costs_less(
    method: StaticMethod, support: SupportModel, command: Callable[..., Sample]
) -> None:
    sample = command(0.66, 0.35)
    best = method.solve(sample)
    support.lock(sample)
    lowest = cost(method, support, sample, best)
    random = np.random.default_rng(0)
    rest = support.rest(sample)[7:]
    for _ in range(30):
        q = pinocchio.integrate(support.model, best.configuration, 0.02 * random.normal(size=support.model.nv))
        wrench = best.wrench.copy()
        for _ in range(5):  # back onto feet and equilibrium, by the least change
            *_, equality, error = method.equilibrium(q, wrench, sample, rest)
            change = -np.linalg.pinv(equality) @ error
            q = pinocchio.integrate(support.model, q, change[: support.model.nv])
            wrench = wrench + change[support.model.nv :].reshape(2, 6)
        assert np.abs(error).max() < 1e-6
        assert cost(method, support, sample, Posture(q, wrench)) > lowest - 1e-4


def test_a_waist_that_takes_the_lean_keeps_the_pelvis_level_as_far_as_it_turns(
    robot: Robot, command: Callable[..., Sample]
) -> None:
    method = StaticMethod(SupportModel(robot, PostureProblem(waist_share=1.0)))
    upright = method.solve(command(0.66, 0.0)).support
    for pitch in (-0.3, 0.2, 0.4):
        bent = method.solve(command(0.66, pitch)).support
        assert bent[robot.waist_pitch].sum() == pytest.approx(pitch, abs=0.06)
        assert bent[0] == pytest.approx(upright[0], abs=0.1), "the hip's pitch"
    stop = method.support.upper[robot.waist_pitch]
    np.testing.assert_allclose(method.solve(command(0.66, 0.8)).support[robot.waist_pitch], stop, atol=1e-3)


def test_what_cannot_be_reached_is_rejected(method: StaticMethod, command: Callable[..., Sample]) -> None:
    with pytest.raises(Rejected):
        method.solve(command(0.95, 0.0))


def test_the_label_does_not_depend_on_what_was_solved_before(
    method: StaticMethod, support: SupportModel, recipe: ReferenceGenerator, command: Callable[..., Sample]
) -> None:
    fresh = StaticMethod(SupportModel(support.robot, recipe.problem)).solve(command(0.6, 0.5))
    method.solve(command(0.72, -0.2))
    np.testing.assert_array_equal(method.solve(command(0.6, 0.5)).configuration, fresh.configuration)
