"""What the teacher alone sees is the truth of the simulation."""

from collections.abc import Callable

import numpy as np
import pytest
from task_worlds import actions

from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]


def part(env: VectorEnv, rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, env.layout.slices[f"privileged/{name}"]]


def test_a_push_on_the_base_is_seen_in_the_heading_frame_while_it_acts(make: Make) -> None:
    often = {"simulation.pushes.interval.low": 0.1, "simulation.pushes.interval.high": 0.3}
    env = make(num_envs=8, changes=often | {"task.curriculum.enabled": False})
    env.reset()
    state, seen = env.batch.simulation.state, 0
    for step in range(40):
        rows, _, done, _ = env.step(actions(step, 8, 0.1))
        force = part(env, rows, "push_force")[~done]
        assert np.linalg.norm(force, axis=1) == pytest.approx(np.linalg.norm(state.push_force[~done], axis=1), rel=1e-5)
        seen += int(force.any(axis=1).sum())
    assert seen > 0


def test_torque_limits_are_below_the_motors_own_where_their_strength_was_drawn_lower(make: Make) -> None:
    env = make(num_envs=4)
    rows = env.reset()
    limits, robot = part(env, rows, "motor_effort"), env.batch.robot
    assert (limits <= robot.effort * (1.0 + 1e-6)).all()
    assert (limits < 0.99 * robot.effort).any()
    assert (limits > 0.0).all()


def test_what_is_drawn_for_sensors_is_seen(make: Make) -> None:
    env = make(num_envs=4)
    rows, drawn = env.reset(), env.drawn()
    for name in ("encoder_bias", "imu_tilt", "gyro_bias"):
        assert part(env, rows, name) == pytest.approx(drawn[name], abs=1e-6)
    assert part(env, rows, "sensor_latency")[:, 0] == pytest.approx(drawn["sensor_latency"], abs=1e-6)
