"""What is sampled: a plan of numbered samples that covers what training will ask."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from iowbc.control.arms import ArmKinematics
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.joint_references import Grasps
from iowbc.reference.labels.plan import SamplePlan
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror


def generator(**sampling: Any) -> ReferenceGenerator:
    return ReferenceGenerator.model_validate({"sampling": {"samples": 2048, **sampling}})


@pytest.fixture(scope="module")
def plan(robot: Robot) -> SamplePlan:
    return SamplePlan(robot, generator(), seed=3)


@pytest.fixture(scope="module")
def drawn(plan: SamplePlan) -> Any:
    return plan.draw(np.arange(plan.drawn))


def test_a_sample_depends_on_its_number_alone(robot: Robot, plan: SamplePlan, drawn: Any) -> None:
    again = SamplePlan(robot, generator(), seed=3)
    for index, sample in zip((700, 3, 2040), again.draw(np.array([700, 3, 2040])), strict=True):
        np.testing.assert_allclose(sample.arm, drawn[index].arm, atol=1e-9)
        np.testing.assert_array_equal(sample.command, drawn[index].command)


def test_another_seed_gives_other_samples(robot: Robot, drawn: Any) -> None:
    other = SamplePlan(robot, generator(), seed=4).draw(np.arange(1))[0]
    assert np.abs(other.arm - drawn[0].arm).max() > 1e-3


def test_commands_are_spread_more_evenly_than_at_random(plan: SamplePlan, drawn: Any) -> None:
    commands = np.array([sample.command[:2] for sample in drawn[: plan.original]])
    inside = commands[
        (commands[:, 0] > 0.5) & (commands[:, 0] < 0.8) & (commands[:, 1] > -0.5) & (commands[:, 1] < 1.5)
    ]
    unit = (inside - [0.5, -0.5]) / [0.3, 2.0]
    random = np.random.default_rng(0).random(unit.shape)
    assert qmc.discrepancy(unit) < 0.5 * qmc.discrepancy(random)


def test_edges_of_the_command_ranges_are_sampled(drawn: Any) -> None:
    commands = np.array([sample.command[:2] for sample in drawn])
    for column, value in ((0, 0.5), (0, 0.8), (1, -0.5), (1, 1.5)):
        assert (commands[:, column] == value).sum() > 10


def test_the_default_arms_are_sampled(plan: SamplePlan, drawn: Any) -> None:
    assert sum(np.array_equal(sample.arm, plan.rest) for sample in drawn) > 0.02 * len(drawn)


def test_mirrored_samples_are_mirror_images_and_share_a_group(robot: Robot, plan: SamplePlan, drawn: Any) -> None:
    mirror = interaction_mirror(robot)
    assert plan.mirrored == int(0.05 * plan.drawn)
    for index in range(plan.original, plan.drawn):
        source = plan.group(index)
        assert plan.group(source) == source
        np.testing.assert_allclose(drawn[index].arm, mirror(drawn[source].arm), atol=1e-9)
        np.testing.assert_array_equal(drawn[index].command, drawn[source].command)


def test_arms_keep_to_the_joint_ranges(robot: Robot, drawn: Any) -> None:
    arms = np.array([sample.arm for sample in drawn])
    assert (arms >= robot.lower[robot.interaction]).all()
    assert (arms <= robot.upper[robot.interaction]).all()


def test_the_teachers_wrists_lie_among_the_sampled_ones(robot: Robot, drawn: Any) -> None:
    kinematics, commands = ArmKinematics(robot), Commands()
    arms = np.array([sample.arm for sample in drawn])
    pitch = np.array([sample.command[1] for sample in drawn])
    rotation, position = kinematics.torso_in_heading(np.zeros((len(arms), 3)), pitch)
    wrists = np.einsum("nij,nsj->nsi", rotation, kinematics.forward(arms)[0]) + position[:, None]
    moderate = (pitch > commands.pitch[0]) & (pitch < commands.pitch[1])
    left = wrists[moderate, 0]
    for _, grasp in Grasps():
        for corner in np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3):
            wanted = np.array(grasp) + corner * commands.common_offset
            assert (np.linalg.norm(left - wanted, axis=1) < 0.08).any(), wanted


def test_joint_ranges_narrow_the_uniform_share(robot: Robot) -> None:
    narrow = {"left_elbow_joint": {"low": 0.2, "high": 0.4}}
    recipe = generator(samples=128, heading_share=0.0, torso_share=0.0, nominal_share=0.0, joint_ranges=narrow)
    samples = SamplePlan(robot, recipe, seed=0).draw(np.arange(100))
    place = [robot.joints[index] for index in robot.interaction].index("left_elbow_joint")
    elbows = np.array([sample.arm[place] for sample in samples])
    assert elbows.min() >= 0.2
    assert elbows.max() <= 0.4
