"""Nominal commands of the robot, intentions of the human, and what joints say about forces on the hands."""

from collections.abc import Callable

import numpy as np
import pytest

from iowbc.control.command import HEIGHT, OFFSET, YAW_RATE
from iowbc.control.hand_forces import HandForces
from iowbc.control.references import ReferenceLayer
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.sim.simulation import Simulation
from iowbc.skill.episodes import Plan
from iowbc.skill.game import TransportGame


@pytest.mark.parametrize("force", [(25.0, 0.0, -10.0), (-15.0, 20.0, -30.0)])
def test_static_forces_on_the_hands_are_estimated_from_the_torques_of_the_arms(
    robot: Robot, force: tuple[float, ...]
) -> None:
    """With q_target = q + (g(q) - Jᵀ F) / kp the arms are in equilibrium under F."""
    references = ReferenceLayer(robot, Recipe(name="test").task.references, None)
    hands = HandForces(robot, references, 1, 1)
    position, down = robot.default_position[None].copy(), np.array([[0.0, 0.0, -1.0]])
    own = robot.interaction
    _, jacobian = references.arms.forward(position[:, own])
    pushed = np.concatenate([jacobian[0, side].T @ np.array(force) for side in range(2)])
    gravity = references.arms.torque(position[:, own], position[:, robot.waist], down)[0]
    target = position.copy()
    target[0, own] += (gravity - pushed) / robot.kp[own]
    hands.add(target, position, np.zeros_like(position))
    hands.read(down)
    assert np.abs(hands.felt[0, -1] - force).max() < 0.15 * np.linalg.norm(force)


def test_the_robot_leads_along_a_path_that_it_knows_and_stands_where_nobody_pulls(
    make: Callable[..., TransportGame],
) -> None:
    plans = [Plan("lift_straight", "path", known, mass=7.0, share=0.5, seed=1) for known in (True, False)]
    game = make(n=2, plans=plans)
    game.reset()
    lead, follow = game.batch._nominals
    assert lead[0] == pytest.approx(game.setup.skill.pursuit.speed)
    assert (follow[:YAW_RATE] == 0.0).all()
    assert abs(follow[YAW_RATE]) < 0.05  # the measured yaw of the object is noisy


def test_commands_stay_within_the_ranges_of_training(make: Callable[..., TransportGame]) -> None:
    plans = [Plan(task, "path", True) for task in ("lift_straight", "push_straight")]
    game = make(n=2, plans=plans)
    game.reset()
    nominal, commands = game.batch._nominal, game.setup.specification.recipe.task.commands
    for action in (-1.0, 1.0):
        command = nominal.with_action(nominal.standing() + 1.0, np.full((2, 11), action))
        assert (command[:, HEIGHT] <= commands.height[1]).all()
        assert command[1, 0] <= commands.pushing.velocity_x[1]
        assert command[1, 1] == 0.0
        assert (np.abs(command[:, OFFSET].reshape(-1, 2, 3).mean(axis=1)) <= commands.common_offset).all()


def test_a_steered_partner_pulls_the_handle_where_it_wants_and_turns_the_object(robot: Robot) -> None:
    held = {"object_mass": 8.0, "partner_share": 0.5, "partner_behaviour": 0.0, "partner_noise": 0.0}
    quiet = {"impulse_scale": 0.0, "push_scale": 0.0, "start_yaw": 0.0, "partner_share_drift": 0.0}
    wanted = np.array([[0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0], [0.0, 0.3, 0.0, 0.0], [0.0, 0.0, 0.5, 0.0]])
    n = len(wanted)
    fixed = {name: np.full(n, value) for name, value in (held | quiet).items()}
    simulation = Simulation(
        robot, Recipe(name="test").simulation, envs=np.zeros(n), seed=0, scenes=["lift"] * n, fixed=fixed
    )
    simulation.partner.steered[:] = True
    simulation.reset(np.arange(n), np.tile(robot.default_position, (n, 1)))
    for _ in range(25):
        simulation.feed[:] = wanted
        simulation.step()
    still, forward, aside, turning = simulation.state.external_force
    assert forward[0] > still[0] + 10.0
    assert aside[1] > still[1] + 10.0
    assert turning[5] > still[5] + 0.3
    rates = simulation.state.object_angular_velocity[:, 2]
    assert np.isfinite(rates).all()
