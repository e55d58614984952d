"""A public controller between s_t and the residual action: order of joints, history, clock, arms, heading."""

from dataclasses import replace

import numpy as np
import pytest

from iowbc.adapters.adapter import Adapter, Seen, scaled
from iowbc.adapters.policy import AdaptedPolicy
from iowbc.control.action import action_scale
from iowbc.control.observation import observation_layout
from iowbc.errors import StageFailed
from iowbc.recipe.evaluation.baselines import PublicController
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot

pytestmark = pytest.mark.unit

TASK = Task.model_validate({"observation": {"observe_object": False}})
CONTROLLER = PublicController(adapter="holosoma", policy="walker.onnx", sha256="0" * 64, heading_gain=0.5)


@pytest.fixture
def adapter(robot: Robot) -> Adapter:
    """Joints in the opposite order; its network gives each joint's place in that order, over 100."""
    joints = robot.joints[::-1]
    answer = np.arange(len(joints), dtype=np.float32)[None] / 100
    return Adapter(
        joints=joints,
        default=np.linspace(-0.1, 0.1, len(joints)),
        kp=np.full(len(joints), 50.0),
        kd=np.full(len(joints), 2.0),
        acted=joints,
        scale=np.linspace(0.1, 0.3, len(joints)),
        frequency=50.0,
        terms=(scaled("joint_deviation"), scaled("velocity")),
        network=lambda observation: answer,
    )


class Watched:
    """A policy whose network keeps what it is given, and rows of s_t to drive it with."""

    def __init__(self, robot: Robot, adapter: Adapter, controller: PublicController = CONTROLLER, n: int = 1) -> None:
        self.given: list[np.ndarray] = []
        self.seen: list[Seen] = []
        answer = adapter.network(np.zeros((1, 1), np.float32))

        def network(observation: np.ndarray) -> np.ndarray:
            self.given.append(observation[0].copy())
            return answer

        def watch(seen: Seen) -> np.ndarray:
            self.seen.append(seen)
            return adapter.terms[0](seen)

        watched = replace(adapter, network=network, terms=(watch, *adapter.terms[1:]))
        self.policy = AdaptedPolicy(controller, watched, robot, TASK)
        self.layout, self.n = observation_layout(robot, observe_object=False), n
        self.policy.reset(np.ones(n, np.bool_))

    def act(self, **parts: object) -> np.ndarray:
        rows = np.zeros((self.n, self.layout.size), np.float32)
        for name, place in self.layout.slices.items():
            rows[:, place] = parts.get(name, 0.0)
        rows[:, self.layout.slices["projected_gravity"]] = (0.0, 0.0, -1.0)
        return self.policy.act(rows, np.zeros((self.n, 0), np.float32))


def test_targets_belong_to_the_joints_that_the_network_names(robot: Robot, adapter: Adapter) -> None:
    reference = np.linspace(-0.3, 0.3, len(robot.support))
    action = Watched(robot, adapter).act(support_reference=reference)[0]
    target = reference + action_scale(robot, TASK.action) * action
    for place, joint in enumerate(robot.support):
        own = adapter.joints.index(robot.joints[joint])
        assert target[place] == pytest.approx(adapter.default[own] + adapter.scale[own] * own / 100, abs=1e-6)


def test_joints_are_observed_as_they_are_in_the_order_of_the_adapter(robot: Robot, adapter: Adapter) -> None:
    watched = Watched(robot, adapter)
    deviation = np.arange(len(robot.joints)) / 50
    watched.act(joint_position=deviation, support_reference=0.5, arm_reference=-0.5)
    (seen,) = watched.seen
    for place, name in enumerate(adapter.joints):
        joint = robot.joints.index(name)
        truth = deviation[joint] + (0.5 if joint in robot.support else -0.5)
        assert seen.joint_position[0, place] == pytest.approx(truth, abs=1e-6)
        assert seen.joint_deviation[0, place] == pytest.approx(truth - adapter.default[place], abs=1e-6)


def test_arms_can_appear_at_rest_in_the_default_posture(robot: Robot, adapter: Adapter) -> None:
    hidden = Watched(robot, adapter, CONTROLLER.model_copy(update={"arms": "default"}))
    hidden.act(arm_reference=1.0, joint_velocity=2.0)
    arms = [place for place, name in enumerate(adapter.joints) if robot.joints.index(name) in robot.interaction]
    legs = [place for place in range(len(adapter.joints)) if place not in arms]
    (seen,) = hidden.seen
    assert not seen.joint_deviation[0, arms].any()
    assert not seen.joint_velocity[0, arms].any()
    assert (seen.joint_velocity[0, legs] == 2.0).all()


def test_arms_that_it_moves_get_their_targets_beside_the_action(robot: Robot, adapter: Adapter) -> None:
    own = Watched(robot, adapter, CONTROLLER.model_copy(update={"arms": "own"})).act()[0]
    support = len(robot.support)
    np.testing.assert_array_equal(own[:support], Watched(robot, adapter).act()[0])
    places = [adapter.joints.index(robot.joints[joint]) for joint in robot.interaction]
    expected = adapter.default[places] + adapter.scale[places] * np.array(places) / 100
    np.testing.assert_allclose(own[support:], expected, atol=1e-6)


@pytest.mark.parametrize(
    ("by_term", "first", "second"),
    [
        (True, [1, 1, 1, 1, 1, 1, 0.1, 0, 0, 0.1, 0, 0], [1, 1, 1, 2, 2, 2, 0.1, 0, 0, 0.2, 0, 0]),
        (False, [1, 1, 1, 0.1, 0, 0, 1, 1, 1, 0.1, 0, 0], [1, 1, 1, 0.1, 0, 0, 2, 2, 2, 0.2, 0, 0]),
    ],
)
def test_a_history_stands_by_part_or_by_observation_and_begins_full(
    robot: Robot, adapter: Adapter, by_term: bool, first: list[float], second: list[float]
) -> None:
    terms = (scaled("angular_velocity"), scaled("velocity"))
    watched = Watched(robot, replace(adapter, terms=terms, history=2, by_term=by_term))
    for value in (1.0, 2.0):
        watched.act(base_angular_velocity=value, command=[0.1 * value, *[0.0] * 10])
    np.testing.assert_allclose(watched.given, [first, second], atol=1e-6)


def test_a_reset_forgets_history_output_and_clock_of_the_marked_robot_alone(robot: Robot, adapter: Adapter) -> None:
    watched = Watched(robot, replace(adapter, history=2), n=2)
    walk = [0.3, *[0.0] * 10]
    for _ in range(3):
        watched.act(command=walk)
    watched.policy.reset(np.array([True, False]))
    watched.act(command=walk)
    seen = watched.seen[-1]
    assert not seen.action[0].any()
    assert seen.action[1].any()
    assert seen.walked[:, 0] == pytest.approx([0.0, 0.06])


def test_the_clock_of_walking_starts_with_the_command_and_stops_with_it(robot: Robot, adapter: Adapter) -> None:
    watched = Watched(robot, adapter)
    for speed in (0.0, 0.3, 0.3, 0.0, 0.3):
        watched.act(command=[speed, *[0.0] * 10])
    assert [bool(seen.walking[0]) for seen in watched.seen] == [False, True, True, False, True]
    assert [float(seen.walked[0, 0]) for seen in watched.seen] == pytest.approx([0.0, 0.0, 0.02, 0.0, 0.0])


def test_the_commanded_yaw_rate_turns_back_what_the_heading_is_off(robot: Robot, adapter: Adapter) -> None:
    watched = Watched(robot, replace(adapter, ranges={"yaw_rate": (-0.2, 0.2)}))
    for speed, error in ((0.3, 0.1), (0.3, 2.0), (0.0, 0.1)):
        watched.act(command=[speed, *[0.0] * 10], heading_error=error)
    rates = [float(seen.velocity[0, 2]) for seen in watched.seen]
    assert rates == pytest.approx([-0.05, -0.2, 0.0]), "gain 0.5, within the range, and none in standing"


def test_rows_that_no_trial_fills_are_left_alone(robot: Robot, adapter: Adapter) -> None:
    watched = Watched(robot, adapter, n=2)
    rows = np.zeros((2, watched.layout.size), np.float32)
    rows[1, watched.layout.slices["projected_gravity"]] = (0.0, 0.0, -1.0)
    action = watched.policy.act(rows, np.zeros((2, 0), np.float32))
    assert not action[0].any()
    assert action[1].any()
    assert len(watched.given) == 1


def test_an_output_that_is_not_finite_ends_the_trials(robot: Robot, adapter: Adapter) -> None:
    broken = Watched(robot, replace(adapter, network=lambda observation: np.full((1, 29), np.nan, np.float32)))
    with pytest.raises(StageFailed, match="output is not finite"):
        broken.act()
