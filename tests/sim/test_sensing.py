"""What the sensors deliver."""

import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot import rotations


def test_without_noise_bias_and_latency_the_truth_is_measured(start, calm):
    simulation = start(calm, ["lift", "push", "free"])
    run(simulation, 12)
    state, measured = simulation.state, simulation.measured
    assert np.array_equal(measured.joint_position, state.joint_position)
    assert np.array_equal(measured.base_angular_velocity, state.base_angular_velocity)
    gravity = rotations.rotate_inverse(state.base_quaternion, np.tile([0.0, 0.0, -1.0], (3, 1)))
    assert np.allclose(measured.projected_gravity, gravity, atol=1e-12)
    place = rotations.rotate_inverse(state.base_quaternion, state.object_position - state.base_position)
    assert np.allclose(measured.object_position[:2], place[:2], atol=1e-12)
    base, thing = rotations.matrix(state.base_quaternion), rotations.matrix(state.object_quaternion)
    turned = np.swapaxes(base, 1, 2) @ thing
    assert np.allclose(rotations.matrix(measured.object_quaternion)[:2], turned[:2], atol=1e-12)


def test_without_an_object_its_pose_is_the_identity_at_the_base(start):
    simulation = start(Recipe(), ["free", "lift"])
    run(simulation, 5)
    assert np.all(simulation.measured.object_position[0] == 0.0)
    assert np.array_equal(simulation.measured.object_quaternion[0], [1.0, 0.0, 0.0, 0.0])
    assert np.all(simulation.measured.object_linear_velocity[0] == 0.0)


def test_measured_object_velocity_is_the_rate_of_its_measured_position(start, calm):
    simulation = start(calm, ["lift"])
    run(simulation, 12)
    before, rate = simulation.measured.object_position.copy(), simulation.measured.object_linear_velocity.copy()
    simulation.step()
    mean = 0.5 * (rate + simulation.measured.object_linear_velocity)
    assert np.allclose((simulation.measured.object_position - before) / simulation.period, mean, atol=0.02)


def test_noise_has_the_deviation_of_the_recipe(start, calm):
    recipe = changed(calm, "sensing.enabled", True)
    simulation = start(recipe, ["lift"] * 4)
    errors = {name: [] for name in ("joint_position", "joint_velocity", "base_angular_velocity")}
    for _ in range(60):
        simulation.step()
        for name, seen in errors.items():
            seen.append(getattr(simulation.measured, name) - getattr(simulation.state, name))
    for name, expected in (("joint_position", 0.01), ("joint_velocity", 0.5), ("base_angular_velocity", 0.1)):
        assert np.std(errors[name]) == pytest.approx(expected, rel=0.06)
        assert abs(np.mean(errors[name])) < 0.1 * expected


def test_encoder_bias_stays_for_an_episode(start, calm):
    recipe = changed(changed(calm, "randomization.enabled", True), "randomization.sensor_latency.enabled", False)
    simulation = start(recipe, ["free"] * 2)
    run(simulation, 3)
    error = simulation.measured.joint_position - simulation.state.joint_position
    assert np.allclose(error, simulation.drawn["encoder_bias"], atol=1e-12)
    assert 0.005 < np.abs(error).max() <= 0.015


def test_a_tilted_inertial_unit_sees_gravity_tilted_and_its_gyroscope_adds_a_bias(start, calm):
    simulation = start(calm, ["free"] * 2, imu_tilt=[0.0, 0.03], gyro_bias=[0.0, 0.02])
    run(simulation, 10)
    gravity, turning = simulation.measured.projected_gravity, simulation.measured.base_angular_velocity
    angle = np.arccos(np.vecdot(gravity[0], gravity[1]))
    assert angle == pytest.approx(np.hypot(0.03, 0.03), rel=0.02)
    assert np.linalg.norm(gravity[1]) == pytest.approx(1.0)
    assert np.allclose(turning[1], turning[0] + 0.02, atol=0.05 * np.abs(turning[0]).max() + 1e-9)


@pytest.mark.parametrize("latency", [0.0, 1.0, 2.0, 1.5])
def test_latency_of_n_periods_delays_measurements_by_n_periods(start, calm, latency):
    simulation = start(calm, ["lift"], sensor_latency=latency, object_latency=latency)
    truth, place = [], []
    for _ in range(12):
        simulation.step()
        truth.append(simulation.state.joint_position.copy())
        state = simulation.state
        place.append(rotations.rotate_inverse(state.base_quaternion, state.object_position - state.base_position))
    whole, part = int(latency), latency % 1.0
    for history, seen in ((truth, simulation.measured.joint_position), (place, simulation.measured.object_position)):
        expected = (1.0 - part) * history[-1 - whole] + part * history[-2 - whole]
        assert np.allclose(seen, expected, atol=1e-12)


def test_noise_scale_zero_is_noise_free(start):
    simulation = start(Recipe(), ["lift"], noise_scale=0.0, sensor_latency=0.0, encoder_bias=0.0)
    run(simulation, 3)
    assert np.allclose(simulation.measured.joint_position, simulation.state.joint_position, atol=1e-12)


def test_the_measured_heading_follows_the_base_and_drifts_at_the_drawn_rate(start, calm):
    simulation = start(calm, ["lift", "free"], heading_drift=np.array([0.0, 0.05]))
    run(simulation, 10)
    rotation = simulation.state.base_rotation
    heading = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    assert simulation.measured.heading[:, 0] - heading == pytest.approx([0.0, 0.05 * 10 * 0.02], abs=1e-12)


def test_a_delayed_heading_passes_half_a_turn_without_a_jump(start, calm):
    simulation = start(calm, ["free"], start_yaw=np.pi - 0.004, heading_drift=0.1, sensor_latency=0.5)
    seen = []
    for _ in range(8):
        simulation.step()
        seen.append(float(simulation.measured.heading[0, 0]))
    assert np.diff(seen) == pytest.approx(np.full(7, 0.1 * 0.02), abs=1e-3)
