"""The walkers of the wheel `holosoma-inference`, where it is installed: their own code sees the same, and they walk."""

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.adapters import holosoma
from iowbc.adapters.adapter import Adapter, Seen, standing
from iowbc.adapters.source import load_adapter
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.simulation.simulation import SimulationSettings
from iowbc.robot.description import Robot
from iowbc.sim.simulation import Simulation

pytestmark = [
    pytest.mark.integration,
    pytest.mark.skipif(find_spec("holosoma_inference") is None, reason="`pip install '.[public]'` brings it"),
    pytest.mark.filterwarnings("ignore"),
]
RECIPE = Path(__file__).parents[2] / "recipes" / "public.yaml"
NAMES = ("holosoma_ppo", "holosoma_fastsac")


def shipped(name: str) -> Adapter:
    study = load_study(RECIPE)
    assert len(study) == 2
    (found,) = (one.recipe.eval.public for one in study if one.recipe.name == name)
    assert found is not None
    return load_adapter(found)


@pytest.fixture(scope="module")
def original() -> Any:
    """Their own policy class with their configuration of the G1, without hardware and network."""
    locomotion = pytest.importorskip("holosoma_inference.policies.locomotion")
    from holosoma_inference.config.config_values import observation, robot, task

    policy = locomotion.LocomotionPolicy.__new__(locomotion.LocomotionPolicy)
    policy.config = SimpleNamespace(robot=robot.g1_29dof, observation=observation.loco_g1_29dof, task=task.locomotion)
    policy.rl_rate = task.locomotion.rl_rate
    policy._init_robot_config(policy.config.robot)
    policy._init_obs_config()
    policy._init_command_components()
    policy._init_phase_components()
    return policy


@pytest.mark.parametrize("name", NAMES)
def test_its_own_code_makes_the_same_observation(name: str, original: Any) -> None:
    adapter, random = shipped(name), np.random.default_rng(3)
    assert adapter.joints == tuple(original.dof_names)
    np.testing.assert_allclose(adapter.default, original.default_dof_angles)
    assert set(adapter.scale) == {original.config.task.policy_action_scale}
    assert adapter.frequency == original.rl_rate
    assert original.gait_period == holosoma.GAIT_PERIOD
    for step in range(80):
        moving = 20 <= step < 60
        velocity = np.array([0.4, -0.1, 0.3]) * moving
        quaternion = random.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        position, speed, rate = random.normal(size=29), random.normal(size=29), random.normal(size=3)
        original.last_policy_action = random.normal(size=(1, 29))
        original.lin_vel_command[0], original.ang_vel_command[0, 0] = velocity[:2], velocity[2]
        original.update_phase_time()
        state = np.concatenate([np.zeros(3), quaternion, position, np.zeros(3), rate, speed])[None]
        theirs = original.prepare_obs_for_rl(state)["actor_obs"]
        walked = 0.02 * (step - 20) if moving else 0.0
        w, x, y, z = quaternion
        gravity = -np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        seen = Seen(
            velocity=velocity[None],
            height=np.zeros((1, 1)),
            pitch=np.zeros((1, 1)),
            walking=np.array([moving]),
            walked=np.array([[walked]]),
            gravity=gravity[None],
            angular_velocity=rate[None],
            joint_position=position[None],
            joint_deviation=position[None] - adapter.default,
            joint_velocity=speed[None],
            action=original.last_policy_action,
        )
        ours = adapter.observed(tuple(term(seen)[:, None] for term in adapter.terms))
        np.testing.assert_allclose(ours, theirs, atol=1e-5, err_msg=f"step {step}")


@pytest.mark.parametrize("name", NAMES)
def test_it_stands_and_walks_with_arms_of_its_own(name: str, robot: Robot) -> None:
    """The standing test: in the nominal world, without sensor noise, it stands for 2 s and then covers its way."""
    adapter = shipped(name)
    height, way = with_own_arms(adapter, robot, np.array([0.5, 0.0, 0.0]), 2.0, 6.0)
    assert height > 0.7
    assert 0.3 < way[0] / 6.0 < 0.6
    assert abs(way[1]) < 0.5


def with_own_arms(
    adapter: Adapter, robot: Robot, velocity: np.ndarray, still: float, walk: float
) -> tuple[float, np.ndarray]:
    """Least height of the pelvis [m] and the way of the walk [m], all joints driven by the controller."""
    places = [robot.joints.index(name) for name in adapter.joints]
    own = {name: np.empty(len(places)) for name in ("kp", "kd", "default_position")}
    for name, values in zip(own, (adapter.kp, adapter.kd, adapter.default), strict=True):
        own[name][places] = values
    world = SimulationSettings.model_validate({"randomization": {"enabled": False}, "sensing": {"enabled": False}})
    calm = {"impulse_scale": np.zeros(1), "push_scale": np.zeros(1), "start_yaw": np.zeros(1)}
    simulation = Simulation(replace(robot, **own), world, envs=np.zeros(1), seed=0, scenes=["free"], fixed=calm)
    simulation.reset(np.zeros(1, np.int64), own["default_position"][None])
    action, height, begin = np.zeros((1, len(places))), np.inf, np.zeros(3)
    for step in range(round((still + walk) * 50)):
        moving, measured = step >= 50 * still, simulation.measured
        if step == 50 * still:
            begin = simulation.state.base_position[0].copy()
        position = measured.joint_position[:, places]
        seen = replace(
            standing(adapter),
            velocity=velocity[None] * moving,
            walking=np.array([moving]),
            walked=np.array([[max(step / 50 - still, 0.0)]]),
            gravity=measured.projected_gravity,
            angular_velocity=measured.base_angular_velocity,
            joint_position=position,
            joint_deviation=position - adapter.default,
            joint_velocity=measured.joint_velocity[:, places],
            action=action,
        )
        observation = adapter.observed(tuple(np.asarray(term(seen))[:, None] for term in adapter.terms))
        action = adapter.network(observation.astype(np.float32)).astype(np.float64)
        simulation.target[0, places] = adapter.default + adapter.scale * action[0]
        simulation.step()
        height = min(height, float(simulation.state.base_position[0, 2]))
    return height, simulation.state.base_position[0] - begin
