"""A crate's wheels resist alike in every direction, and against its motion."""

import numpy as np
import pytest
from changes import changed
from stepping import run

GRAVITY = 9.81
MASS, FRICTION = 40.0, 0.08
RESISTANCE = FRICTION * MASS * GRAVITY
ANGLES = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False) + 0.1


@pytest.fixture
def crates(start, calm, monkeypatch):
    """Makes crates out of the robots' reach, at rest in any heading, each under a wrench that stays, (n, 6)."""

    def make(wrench, **held):
        n = len(wrench)
        recipe = changed(calm, "scenes.push.gap", 3.0)
        yaw = np.random.default_rng(0).uniform(-3.0, 3.0, n)
        held = {"object_mass": MASS, "object_ground_friction": FRICTION, "start_yaw": yaw} | held
        simulation = start(recipe, ["push"] * n, **held)

        def push(commanded, gust, state, out):
            out[:] = wrench

        monkeypatch.setattr(simulation.partner, "wrench", push)
        return simulation

    return make


def planar(size, angles):
    wrench = np.zeros((len(angles), 6))
    wrench[:, 0], wrench[:, 1] = size * np.cos(angles), size * np.sin(angles)
    return wrench


@pytest.mark.parametrize(("factor", "moves"), [(0.97, False), (1.03, True)])
def test_a_push_in_any_direction_starts_at_the_rolling_resistance(crates, factor, moves):
    simulation = crates(planar(factor * RESISTANCE, ANGLES))
    begin = simulation.state.object_position.copy()
    run(simulation, 100)
    way = np.linalg.norm((simulation.state.object_position - begin)[:, :2], axis=1)
    expected = 0.5 * (factor - 1.0) * RESISTANCE / MASS * 2.0**2
    assert way == pytest.approx(expected if moves else 0.0, abs=0.006)


def test_a_sliding_crate_is_slowed_against_its_motion_and_keeps_its_direction(crates):
    wrench = planar(3.0 * RESISTANCE, ANGLES)
    simulation = crates(wrench)
    run(simulation, 30)
    speed = np.linalg.norm(simulation.state.object_linear_velocity[:, :2], axis=1)
    assert speed == pytest.approx(2.0 * RESISTANCE / MASS * 0.6, rel=0.03)
    wrench[:] = 0.0
    run(simulation, 20)
    velocity = simulation.state.object_linear_velocity[:, :2]
    slower = np.linalg.norm(velocity, axis=1)
    assert speed - slower == pytest.approx(RESISTANCE / MASS * 0.4, rel=0.03)
    assert np.arctan2(velocity[:, 1], velocity[:, 0]) % (2.0 * np.pi) == pytest.approx(ANGLES, abs=0.01)
    run(simulation, 60)
    assert np.abs(simulation.state.object_linear_velocity).max() < 0.003


def test_a_crate_turns_about_its_centre_from_resistance_times_arm(crates, calm):
    limit = RESISTANCE * calm.scenes.push.yaw_arm
    wrench = np.zeros((2, 6))
    wrench[:, 5] = 0.97 * limit, 1.2 * limit
    simulation = crates(wrench)
    run(simulation, 60)
    assert abs(simulation.state.object_angular_velocity[0, 2]) < 0.01
    assert simulation.state.object_angular_velocity[1, 2] > 0.1


def test_a_crate_that_slides_gives_way_to_a_small_push_from_the_side(crates):
    wrench = planar(2.0 * RESISTANCE, ANGLES)
    simulation = crates(wrench)
    run(simulation, 40)
    side = ANGLES + 0.5 * np.pi
    wrench += planar(0.3 * RESISTANCE, side)
    run(simulation, 20)
    velocity = simulation.state.object_linear_velocity[:, :2]
    sideways = velocity[:, 0] * np.cos(side) + velocity[:, 1] * np.sin(side)
    assert np.all(sideways > 0.05)


def test_fifty_times_the_resistance_blocks_a_crate(crates):
    simulation = crates(planar(10.0 * RESISTANCE, ANGLES), resistance_scale=50.0)
    begin = simulation.state.object_position.copy()
    run(simulation, 100)
    assert np.abs(simulation.state.object_position - begin).max() < 0.02
