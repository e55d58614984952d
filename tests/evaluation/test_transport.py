"""How much of the commanded way is covered, on paths that are known."""

import numpy as np
import pytest

from iowbc.arrays import Array
from iowbc.evaluation.trials.errors import beside, commanded_path, covered
from iowbc.evaluation.trials.metrics import succeeded
from iowbc.recipe.evaluation.evaluation import Success
from iowbc.task.episodes import CommandScript, CommandSegment

DT = 0.02
REST = (0.72, 0.0, *[0.0] * 6)


def given(*velocities: tuple[float, float, float]) -> Array:
    """Five seconds of each velocity, in order."""
    segments = tuple(CommandSegment(5.0, (*velocity, *REST)) for velocity in velocities)
    script = CommandScript(segments)
    return script.at(DT * np.arange(round(script.duration / DT)))


def walked(commands: Array, heading: float, speed: float) -> Array:
    """The path of who follows the commands at a part of their speed."""
    yaw = heading + DT * np.cumsum(commands[:, 2])
    forward, left = speed * commands[:, 0], speed * commands[:, 1]
    steps = np.stack([np.cos(yaw) * forward - np.sin(yaw) * left, np.sin(yaw) * forward + np.cos(yaw) * left], axis=1)
    return np.cumsum(DT * steps, axis=0)


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_who_follows_covers_all_and_who_goes_at_half_speed_half(heading: float) -> None:
    commands = given((0.5, 0.0, 0.0), (0.4, 0.1, 0.4), (-0.3, 0.0, 0.0))
    directions, length = commanded_path(commands, heading, DT)
    assert length == pytest.approx(2.5 + 5 * np.hypot(0.4, 0.1) + 1.5, rel=0.01)
    for speed in (1.0, 0.5, 0.0):
        assert covered(walked(commands, heading, speed), directions, length) == pytest.approx(speed, abs=0.005)


def test_back_and_forth_cancels_in_the_path_but_not_in_what_is_covered() -> None:
    commands = given((0.3, 0.0, 0.0), (-0.3, 0.0, 0.0))
    directions, length = commanded_path(commands, 0.0, DT)
    path = walked(commands, 0.0, 1.0)
    assert path[-1] == pytest.approx([0.0, 0.0], abs=0.02)
    assert covered(path, directions, length) == pytest.approx(1.0, abs=0.01)


def test_swaying_on_the_spot_and_running_aside_cover_nothing() -> None:
    commands = given((0.5, 0.0, 0.0))
    directions, length = commanded_path(commands, 0.0, DT)
    time = DT * np.arange(len(commands))
    sway = np.stack([0.05 * np.sin(2 * np.pi * time), 0.3 * time], axis=1)
    assert covered(sway, directions, length) == pytest.approx(0.0, abs=0.02)


def test_a_fall_halfway_covers_half() -> None:
    commands = given((0.5, 0.0, 0.0))
    directions, length = commanded_path(commands, 0.0, DT)
    assert covered(walked(commands, 0.0, 1.0)[:125], directions, length) == pytest.approx(0.5, abs=0.01)


def test_a_trial_of_standing_asks_for_no_transport() -> None:
    directions, length = commanded_path(given((0.0, 0.0, 0.3)), 0.0, DT)
    assert np.isnan(covered(np.zeros((10, 2)), directions, length))


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_what_counts_of_an_object_beside_the_robot_is_the_furthest_it_came_while_steps_were_asked_for(
    heading: float,
) -> None:
    forward, left = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    robot = np.linspace(0.0, 2.0, 100)[:, None] * forward
    aside = np.concatenate([np.linspace(0.0, -0.2, 50), np.full(50, 0.6)])
    crate = robot + 0.9 * forward + aside[:, None] * left
    asked = np.arange(100) < 50
    assert beside(robot, np.full(100, heading), crate, asked) == pytest.approx(0.2)
    assert beside(robot, np.full(100, heading), crate, ~asked) == pytest.approx(0.6)
    assert np.isnan(beside(robot, np.full(100, heading), crate, np.zeros(100, np.bool_)))


def test_success_asks_for_transport_of_robot_and_object() -> None:
    ways = {"E_alpha": 0.1, "E_h": 0.01, "transport_robot": 0.6, "transport_object": 0.6, "weight_in_hands": 0.99}
    ways |= {"object_beside": 0.2}
    assert succeeded(Success(), "lifting", ways)
    assert not succeeded(Success(), "lifting", ways | {"transport_robot": 0.4})
    assert not succeeded(Success(), "pushing", ways | {"transport_object": 0.1})
    assert succeeded(Success(), "lifting", ways | {"transport_object": np.nan}), "no object to bring along"
    assert succeeded(Success(transport=0.1), "lifting", ways | {"transport_robot": 0.2})
    assert not succeeded(Success(), "lifting", ways | {"weight_in_hands": 0.9}), "the rest lies in its lap"
    assert succeeded(Success(weight_in_hands=0.8), "lifting", ways | {"weight_in_hands": 0.9})
    assert succeeded(Success(), "pushing", ways | {"weight_in_hands": np.nan}), "nothing is held"
    assert not succeeded(Success(), "pushing", ways | {"object_beside": 0.4}), "the crate is lost at its side"
    assert succeeded(Success(object_beside=0.5), "pushing", ways | {"object_beside": 0.4})
    assert succeeded(Success(), "lifting", ways | {"object_beside": np.nan}), "no object to lose"


def test_stagnation_asks_for_posture_and_not_for_transport() -> None:
    stuck = {"E_alpha": 0.1, "E_h": 0.01, "transport_robot": 0.0, "transport_object": 0.0}
    stuck |= {"push_force_share": 0.6, "foot_slip": 0.5, "seconds": 10.0}
    assert succeeded(Success(), "stagnation", stuck)
    assert not succeeded(Success(), "stagnation", stuck | {"E_alpha": 0.4})
    assert not succeeded(Success(), "stagnation", stuck | {"E_h": 0.2})
