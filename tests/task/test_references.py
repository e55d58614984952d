"""The reference layer: wrists go where the command says, and the support branch follows the generator."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from task_worlds import QUIET, rollout, same

from iowbc.control.command import HEIGHT, OFFSET, PITCH, nominal_command
from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.joint_references import ArmReference, GaitPrior, References
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
GRASP = both_wrists(References().grasps.lift)[None]


@pytest.fixture(scope="module")
def generator(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A generator that bends the knees a little with the commanded height, and a feasible map."""
    folder, joints, random = tmp_path_factory.mktemp("rg"), np.array(robot.joints), np.random.default_rng(0)
    shapes = ((64, 16), (15, 64))
    ReferenceNetwork(
        inputs=(*joints[robot.interaction], "pelvis_height", "torso_pitch"),
        outputs=tuple(joints[robot.support]),
        layers=tuple((random.normal(size=shape) / shape[1] ** 0.5, np.zeros(shape[0])) for shape in shapes),
        input_mean=np.zeros(16),
        input_std=np.ones(16),
        output_mean=robot.default_position[robot.support],
        output_std=np.full(15, 0.03),
        lower=robot.lower[robot.support],
        upper=robot.upper[robot.support],
    ).save(folder)
    FeasibleMap(np.array([-0.2, 0.6]), np.array([0.6, 0.6]), np.array([0.75, 0.75])).save(folder / "feasible.npz")
    return folder


@pytest.fixture
def layer(robot: Robot) -> ReferenceLayer:
    return ReferenceLayer(robot, References(), None)


def command(**parts: Any) -> Any:
    values = nominal_command(Recipe(name="x").task.commands)[None].copy()
    for name, value in parts.items():
        values[0, {"height": HEIGHT, "pitch": PITCH, "offset": OFFSET}[name]] = value
    return values


def wrists(layer: ReferenceLayer, arms: Any, support: Any, asked: Any) -> Any:
    """Wrist positions in the heading frame that the references stand for, (2, 3)."""
    rotation, position = layer.arms.torso_in_heading(support[:, layer.waist], layer.pelvis_pitch(support, asked))
    return (layer.arms.forward(arms)[0] @ np.swapaxes(rotation, 1, 2) + position[:, None])[0]


@pytest.mark.parametrize("pitch", [0.0, 0.3])
def test_an_episode_starts_with_the_wrists_at_the_base_grasp_and_the_offset(
    layer: ReferenceLayer, pitch: float
) -> None:
    asked = command(pitch=pitch, offset=(0.02, 0.01, 0.03, 0.0, 0.01, -0.03))
    arms, support = layer.start(asked, GRASP)
    ahead = [0.3 * np.sin(pitch), 0.0, 0.0]
    expected = GRASP[0] + asked[0, OFFSET].reshape(2, 3) + ahead
    assert wrists(layer, arms, support, asked) == pytest.approx(expected, abs=2e-3)


def test_arms_do_not_creep_after_the_start(layer: ReferenceLayer) -> None:
    asked = command()
    arms, support = layer.start(asked, GRASP)
    later = arms
    for _ in range(100):
        later, support = layer.advance(later, support, asked, GRASP, 0.02)
    assert np.abs(later - arms).max() < 0.02


def test_wrists_follow_a_moving_command(layer: ReferenceLayer) -> None:
    asked = command()
    arms, support = layer.start(asked, GRASP)
    for step in range(50):
        asked[0, OFFSET] = np.tile([0.0, 0.0, 0.05 * (step + 1) / 50], 2)
        arms, support = layer.advance(arms, support, asked, GRASP, 0.02)
    assert wrists(layer, arms, support, asked) == pytest.approx(GRASP[0] + [0.0, 0.0, 0.05], abs=4e-3)


def test_without_a_generator_the_support_reference_is_the_default_posture(layer: ReferenceLayer, robot: Robot) -> None:
    _, support = layer.start(command(height=0.6, pitch=0.4), GRASP)
    assert np.array_equal(support[0], robot.default_position[robot.support])
    assert layer.start_pitch(support, command(pitch=0.4))[0] == 0.0
    assert layer.clamp(command(height=0.1))[0, HEIGHT] == 0.1


def test_an_episode_starts_in_the_commanded_posture_only_with_a_generator(
    layer: ReferenceLayer, robot: Robot, generator: Path
) -> None:
    asked = command(height=0.65, pitch=0.4)
    assert np.array_equal(ReferenceLayer(robot, References(), generator).start_command(asked), asked)
    start = layer.start_command(asked)[0]
    assert (start[HEIGHT], start[PITCH]) == (robot.default_height, 0.0)


def test_a_robot_with_spread_feet_begins_as_it_stands(robot: Robot, generator: Path) -> None:
    gait = GaitPrior(spread=0.04)
    narrow, wide = (ReferenceLayer(robot, References(gait=prior), generator) for prior in (GaitPrior(), gait))
    arms, begin = wide.start(command(), GRASP)
    rest = np.zeros(1)
    standing = wide.with_stride(wide.support(arms, command()), command(), rest, rest > 0.0)
    assert np.array_equal(begin, standing)
    assert np.abs(begin - narrow.start(command(), GRASP)[1]).max() > 0.03


def test_with_a_generator_commands_are_clamped_to_the_feasible_map(robot: Robot, generator: Path) -> None:
    layer = ReferenceLayer(robot, References(), generator)
    clamped = layer.clamp(command(height=0.9, pitch=1.0))
    assert (clamped[0, HEIGHT], clamped[0, PITCH]) == (0.75, 0.6)
    assert np.array_equal(layer.clamp(clamped), clamped)


def test_a_recipe_can_leave_the_generator_out_and_keep_the_map(robot: Robot, generator: Path) -> None:
    layer = ReferenceLayer(robot, References(use_rg=False), generator)
    _, support = layer.start(command(height=0.6), GRASP)
    assert np.array_equal(support[0], robot.default_position[robot.support])
    assert layer.clamp(command(height=0.9))[0, HEIGHT] == 0.75


def test_the_generators_posture_does_not_depend_on_the_company(robot: Robot, generator: Path) -> None:
    layer = ReferenceLayer(robot, References(), generator)
    random = np.random.default_rng(1)
    arms, asked = random.normal(size=(29, 14)), np.tile(command(), (29, 1))
    asked[:, HEIGHT] = random.uniform(0.6, 0.75, 29)
    together = layer.support(arms, asked)
    one_by_one = np.concatenate([layer.support(arms[i : i + 1], asked[i : i + 1]) for i in range(29)])
    assert np.array_equal(together, one_by_one)


def test_rollouts_with_a_generator_do_not_depend_on_the_number_of_workers(
    robot: Robot, generator: Path, folder: Path, recipe: Recipe
) -> None:
    courses = []
    for workers in (0, 2):
        env = VectorEnv(Specification(recipe, folder, generator), num_envs=5, workers=workers, seed=3)
        try:
            courses.append({"start": env.reset()} | rollout(env, 40))
        finally:
            env.close()
    assert same(*courses)


def test_arms_are_driven_ahead_of_their_references_by_what_their_weight_and_the_expected_load_bend_them(
    layer: ReferenceLayer, robot: Robot
) -> None:
    asked = command()
    arms, support = layer.start(asked, GRASP)
    alone, laden = (layer.arm_target(arms, support, asked, np.array([load])) for load in (0.0, 4.0))
    _, jacobian = layer.arms.forward(arms)
    upright = jacobian[0, :, 2].ravel()  # rise of each wrist with its joints
    torque = (laden - alone)[0] * robot.kp[robot.interaction]
    assert torque == pytest.approx(0.5 * 4.0 * 9.81 * upright, abs=0.05)
    unweighted = ReferenceLayer(robot, References(arms=ArmReference(gravity=False)), None)
    assert np.array_equal(unweighted.arm_target(arms, support, asked, np.array([4.0])), arms)


def test_the_observed_references_are_those_that_the_joints_are_driven_to(make: Make, robot: Robot) -> None:
    env = make(num_envs=2, changes=QUIET | {"task.references.arms.gravity": False})
    rows = env.reset()
    place = env.layout.state.slices
    batch = env.batch
    target = batch.targets(np.zeros((2, 15)))
    assert rows[:, place["support_reference"]] == pytest.approx(target[:, robot.support], abs=1e-6)
    measured = batch.simulation.measured.joint_position - target
    assert rows[:, place["joint_position"]] == pytest.approx(measured, abs=1e-6)
    unit = batch.targets(np.ones((2, 15)))
    assert (unit - target)[:, robot.support] == pytest.approx(np.tile(robot.action_scale, (2, 1)))
    assert np.array_equal(unit[:, robot.interaction], target[:, robot.interaction])


def test_motors_follow_a_share_of_the_previous_action(make: Make, robot: Robot) -> None:
    """An action that alternates from step to step moves no joint target if half of each is the previous action."""
    env = make(num_envs=2, changes=QUIET | {"task.action.previous_share": 0.5})
    env.reset()
    env.step(np.ones((2, 15), np.float32))
    batch = env.batch
    still = batch.targets(-np.ones((2, 15)))[:, robot.support] - batch.memory.support
    assert still == pytest.approx(0.0, abs=1e-12)
    moved = batch.targets(np.ones((2, 15)))[:, robot.support] - batch.memory.support
    assert moved == pytest.approx(np.tile(robot.action_scale, (2, 1)))
