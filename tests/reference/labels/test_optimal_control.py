"""The optimal control problem over a horizon, and static labels held against it."""

from collections.abc import Callable

import numpy as np
import pinocchio
import pytest

from iowbc.pipeline.stage import Job
from iowbc.recipe.generator import LabelGates, PostureProblem, ReferenceGenerator
from iowbc.reference.labels.checks import LabelChecker, chosen_for_crosscheck, compare_methods
from iowbc.reference.labels.dataset import Dataset, Shard
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.optimal_control import OptimalControlMethod, distribute, kinematic_start
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import Robot

COMMANDS = ((0.70, 0.0), (0.60, 0.4), (0.66, -0.2), (0.68, 0.9))


@pytest.fixture(scope="module")
def method(support: SupportModel, recipe: ReferenceGenerator) -> OptimalControlMethod:
    return OptimalControlMethod(support, recipe)


def test_mid_horizon_postures_equal_static_labels(
    method: OptimalControlMethod, support: SupportModel, command: Callable[..., Sample]
) -> None:
    static = StaticMethod(support)
    for height, pitch in COMMANDS:
        sample = command(height, pitch)
        np.testing.assert_allclose(method.solve(sample).support, static.solve(sample).support, atol=0.02)


def test_its_waist_takes_the_lean_as_that_of_static_labels_does(robot: Robot, command: Callable[..., Sample]) -> None:
    recipe = ReferenceGenerator(problem=PostureProblem(waist_share=1.0))
    support = SupportModel(robot, recipe.problem)
    sample = command(0.66, 0.35)
    solved = OptimalControlMethod(support, recipe).solve(sample).support
    np.testing.assert_allclose(solved, StaticMethod(support).solve(sample).support, atol=0.02)
    assert solved[robot.waist_pitch].sum() > 0.3


def test_its_postures_pass_the_physical_gates(
    method: OptimalControlMethod, support: SupportModel, command: Callable[..., Sample]
) -> None:
    judge = LabelChecker(support, LabelGates())
    for height, pitch in COMMANDS:
        sample = command(height, pitch)
        judge.label(sample, method.solve(sample))


def test_the_horizon_starts_at_rest_and_ends_at_rest(
    method: OptimalControlMethod, support: SupportModel, command: Callable[..., Sample]
) -> None:
    sample = command(0.62, 0.5)
    support.lock(sample)
    states = method.trajectory(sample)
    assert len(states) == method.ocp.nodes + 1
    speeds = [float(np.linalg.norm(state[support.model.nq :])) for state in states]
    assert speeds[0] == 0.0
    assert speeds[-1] < method.ocp.settled
    assert max(speeds) > 1e-3, "the optimum is not the kinematic start"


def test_the_label_does_not_depend_on_what_was_solved_before(
    method: OptimalControlMethod, support: SupportModel, recipe: ReferenceGenerator, command: Callable[..., Sample]
) -> None:
    fresh = OptimalControlMethod(SupportModel(support.robot, recipe.problem), recipe).solve(command(0.6, 0.5))
    method.solve(command(0.72, -0.2))
    np.testing.assert_array_equal(method.solve(command(0.6, 0.5)).configuration, fresh.configuration)


def test_the_ground_carries_the_robots_weight(method: OptimalControlMethod, command: Callable[..., Sample]) -> None:
    found = method.solve(command(0.68, 0.2))
    assert found.wrench[:, 2].sum() == pytest.approx(9.81 * 33.341142, rel=1e-3)


def test_the_kinematic_start_stands_as_commanded(support: SupportModel, command: Callable[..., Sample]) -> None:
    for height, pitch in COMMANDS:
        sample = command(height, pitch)
        support.lock(sample)
        q = kinematic_start(support, sample)
        com = pinocchio.centerOfMass(support.model, support.data, q).copy()
        pinocchio.framesForwardKinematics(support.model, support.data, q)
        for sole, place in zip(support.soles, support.stance, strict=True):
            assert np.linalg.norm(pinocchio.log6(place.actInv(support.data.oMf[sole])).vector) < 1e-4
        assert support.data.oMf[support.base].translation[2] == pytest.approx(height, abs=5e-3)
        assert np.abs(com[:2]).max() < 5e-3


def test_wrenches_are_distributed_as_in_the_static_optimum(
    support: SupportModel, command: Callable[..., Sample]
) -> None:
    label = StaticMethod(support).solve(command(0.64, 0.4))
    wrench = distribute(support, label.configuration)
    np.testing.assert_allclose(wrench, label.wrench, atol=0.5)


def test_the_cross_check_measures_the_largest_joint_difference(robot: Robot, dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    rows = np.array([1, 5, 9, 20])
    other = dataset.support[rows[:3]].copy()
    other[0, 3] += 0.01
    other[2, 14] -= 0.05
    again = Shard(dataset.index[rows[:3]], {"support": other}, dataset.index[rows[3:]], ["feet"])
    check = compare_methods(dataset, again)
    assert check is not None
    np.testing.assert_allclose(check.difference, [0.01, 0.0, 0.05], atol=1e-12)
    assert check.metrics["crosscheck_max"] == pytest.approx(0.05)
    assert check.metrics["crosscheck_solved"] == pytest.approx(0.75)
    assert f"number {dataset.index[9]} " in check.worst[0]


def test_the_cross_check_takes_drawn_samples_from_all_over_the_dataset(robot: Robot, dataset_job: Job) -> None:
    dataset, rg = Dataset.load(dataset_job.out / "dataset.npz"), dataset_job.recipe.rg
    plan = SamplePlan(robot, rg, dataset_job.recipe.seed)
    wider = rg.model_copy(update={"crosscheck": rg.crosscheck.model_copy(update={"samples": 20})})
    chosen = chosen_for_crosscheck(dataset, plan, wider)
    assert len(set(chosen)) == 20
    assert max(chosen) < plan.drawn
    assert set(chosen) <= set(dataset.index.tolist())
    assert max(chosen) - min(chosen) > 0.9 * plan.drawn
