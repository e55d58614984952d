"""The quadratic program obeys statics and the limits of motors and soles, whatever state it meets."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest

from iowbc.errors import Rejected
from iowbc.model_based.balance import Balance, Solution
from iowbc.recipe.evaluation.baselines import ModelBased
from iowbc.reference.labels.support_model import Sample
from iowbc.robot.description import GRAVITY, Robot

MASS = 33.341142
"""Of the 29-joint G1 [kg]."""
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def balance(robot: Robot) -> Balance:
    return Balance(robot, ModelBased())


def ground_force(balance: Balance, solution: Solution) -> Any:
    """Of both soles together, world axes, (3,) [N]; in the configuration that pinocchio computed last."""
    turned = [balance.data.oMf[sole].rotation for sole in balance.support.soles]
    return sum(rotation @ wrench[:3] for rotation, wrench in zip(turned, solution.wrench, strict=True))


@dataclass(frozen=True)
class Case:
    """A state that the program meets, and what it answers."""

    q: Any
    v: Any
    solution: Solution


@pytest.fixture(scope="module")
def cases(balance: Balance, robot: Robot) -> list[Case]:
    """Crouched, leaning and moving states around the default posture, with commands far from them."""
    return list(_cases(balance, robot))


def _cases(balance: Balance, robot: Robot) -> Iterator[Case]:
    random = np.random.default_rng(0)
    arms, posture = robot.default_position[robot.interaction], robot.default_position[robot.support]
    for _ in range(40):
        tilt = random.normal(scale=0.1, size=3) * [1.0, 1.0, 0.0]
        q = balance.configuration(DOWN + tilt, posture + random.normal(scale=0.05, size=15))
        v = balance.velocity(q, random.normal(scale=0.3, size=18))
        command = np.array([random.uniform(0.5, 0.76), random.uniform(-0.2, 0.7)])
        yield Case(q, v, balance.solve(q, v, arms, command, posture))


def test_a_robot_at_rest_that_wants_nothing_stands_on_its_weight(robot: Robot) -> None:
    still = {"weight": 1.0, "stiffness": 0.0, "damping": 0.0}
    tasks = dict.fromkeys(("com", "height", "torso", "posture"), still)
    balance = Balance(robot, ModelBased.model_validate({**tasks, "torque_weight": 1e-9}))
    posture = robot.default_position[robot.support]
    q, command = balance.configuration(DOWN, posture), np.array([robot.default_height, 0.0])
    solution = balance.solve(q, np.zeros(21), robot.default_position[robot.interaction], command, posture)
    np.testing.assert_allclose(solution.acceleration, 0.0, atol=1e-4)
    np.testing.assert_allclose(ground_force(balance, solution), [0.0, 0.0, MASS * GRAVITY], atol=1e-2)


def test_ground_forces_carry_the_weight_and_what_accelerates_it(balance: Balance, cases: list[Case]) -> None:
    for case in cases:
        pinocchio.centerOfMass(balance.model, balance.data, case.q, case.v, case.solution.acceleration)
        pinocchio.updateFramePlacements(balance.model, balance.data)
        upward = balance.data.acom[0] + [0.0, 0.0, GRAVITY]
        np.testing.assert_allclose(ground_force(balance, case.solution), MASS * upward, atol=1e-4)


def test_torques_are_within_the_limits_of_motors_and_linkages(robot: Robot, cases: list[Case]) -> None:
    effort, names = robot.effort[robot.support], [robot.joints[index] for index in robot.support]
    pairs = [[names.index(robot.joints[joint]) for joint in pair] for pair in robot.linkages]
    assert len(pairs) == 3
    for case in cases:
        size = np.abs(case.solution.torque)
        assert (size <= effort + 1e-6).all()
        for pair in pairs:
            assert size[pair].sum() <= effort[pair[0]] + 1e-6


def test_each_sole_stays_in_its_friction_cone_and_within_its_edges(robot: Robot, cases: list[Case]) -> None:
    friction, half = ModelBased().friction, np.abs(robot.sole_polygon).min(axis=(0, 1))
    for case in cases:
        for force_x, force_y, normal, moment_x, moment_y, _ in case.solution.wrench:
            assert normal >= ModelBased().smallest_load - 1e-6
            assert np.hypot(force_x, force_y) <= friction * normal + 1e-6
            assert abs(moment_y) <= half[0] * normal + 1e-6
            assert abs(moment_x) <= half[1] * normal + 1e-6


def test_soles_come_to_rest(balance: Balance, cases: list[Case]) -> None:
    damping = ModelBased().contact_damping
    for case in cases:
        pinocchio.forwardKinematics(balance.model, balance.data, case.q, case.v, case.solution.acceleration)
        for sole in balance.support.soles:
            moving = pinocchio.getFrameVelocity(balance.model, balance.data, sole, pinocchio.LOCAL).vector
            gained = pinocchio.getFrameAcceleration(balance.model, balance.data, sole, pinocchio.LOCAL).vector
            np.testing.assert_allclose(gained, -damping * moving, atol=1e-6)


def test_pinocchio_and_mujoco_agree_on_the_torques_that_hold_a_posture(balance: Balance, robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    simulated, random = mujoco.MjData(model), np.random.default_rng(1)
    supported = np.concatenate([np.arange(6), 6 + robot.support])
    for _ in range(20):
        joints = random.uniform(robot.lower, robot.upper)
        simulated.qpos[:7], simulated.qpos[7:] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], joints
        mujoco.mj_forward(model, simulated)
        balance.support.lock(Sample(joints[robot.interaction], np.zeros(2)))
        q = np.concatenate([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], joints[robot.support]])
        held = pinocchio.computeGeneralizedGravity(balance.model, balance.data, q)
        np.testing.assert_allclose(held, simulated.qfrc_bias[supported], atol=1e-8)


def test_a_program_without_a_solution_is_refused(robot: Robot) -> None:
    heavy = Balance(robot, ModelBased(smallest_load=MASS * GRAVITY, effort_fraction=0.05))
    arms, posture = robot.default_position[robot.interaction], robot.default_position[robot.support]
    q, command = heavy.configuration(DOWN, posture), np.array([robot.default_height, 0.0])
    with pytest.raises(Rejected):
        heavy.solve(q, np.zeros(21), arms, command, posture)


def test_a_joint_on_its_stop_has_more_than_its_motor(robot: Robot) -> None:
    waist = [robot.joints[index] for index in robot.support].index("waist_pitch_joint")
    posture, bowed = robot.default_position[robot.support].copy(), np.array([0.62, 0.0])
    posture[waist] = robot.upper[robot.support][waist]
    for stop, most in ((0.0, robot.effort[robot.support][waist]), (60.0, np.inf)):
        balance = Balance(robot, ModelBased(stop_torque=stop))
        q = balance.configuration(np.array([0.5, 0.0, -1.0]), posture)
        solution = balance.solve(q, np.zeros(21), robot.default_position[robot.interaction], bowed, posture)
        torque = abs(solution.torque[waist])
        assert torque <= most
    assert torque > robot.effort[robot.support][waist], "the torso is to rise from a deep bow"
