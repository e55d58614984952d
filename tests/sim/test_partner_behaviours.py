"""Behaviours of the partner: what each does to a handle that moves in a prescribed way."""

import numpy as np
import pytest
from changes import changed
from pydantic import TypeAdapter, ValidationError

from iowbc.recipe.simulation.holding import HOLDABLE, Held
from iowbc.recipe.simulation.partner import BEHAVIOURS, Behaviours
from iowbc.recipe.simulation.partner import PartnerSettings as Recipe
from iowbc.recipe.simulation.simulation import SimulationSettings
from iowbc.sim.episode_draws import Draws
from iowbc.sim.partner import Partner
from iowbc.sim.state import SimulationState

PERIOD = 0.02
MASS = 7.0
LEAD = 6.0
"""Largest force of a spring whose aim is at the end of a period at 0.5 m/s, and the handle at its start [N]."""


class Handle:
    """Partners of one box whose motion is prescribed."""

    def __init__(self, robot, behaviour, *, share=0.4, recipe=None, **held):
        simulation = SimulationSettings() if recipe is None else recipe
        scenes = [simulation.scenes.lift]
        draws = Draws(simulation, scenes, robot)
        held = {"partner_noise": 0.0, "partner_share_drift": 0.0, "partner_pace": 1.0, "partner_delay": 0.0} | held
        held |= {"partner_behaviour": BEHAVIOURS.index(behaviour), "partner_share": share, "object_mass": MASS}
        fixed = {name: np.array([float(value)]) for name, value in held.items()}
        draws.draw(np.arange(1), np.ones(1, np.uint64), fixed)
        self.state = SimulationState(1, 29)
        self.state.base_rotation[:] = np.eye(3)
        self.partner = Partner(simulation.partner, scenes, PERIOD)
        self.partner.reset(np.arange(1), draws.values, self.state)
        self.wrench = np.zeros((1, 6))

    def move(self, velocity, command, seconds):
        """Moves the box at a velocity (3,) [m/s] under a command (v_x, v_y, yaw rate, height); forces, (T, 3) [N]."""
        forces = []
        for _ in range(round(seconds / PERIOD)):
            self.partner.wrench(np.array([command], float), np.zeros((1, 3)), self.state, self.wrench)
            self.state.object_linear_velocity[0] = velocity
            self.state.object_position[0] += PERIOD * np.array(velocity)
            self.partner.observe(self.state)
            forces.append(self.wrench[0, :3].copy())
        return np.array(forces)


STAND, WALK = (0.0, 0.0, 0.0, 0.7), (0.5, 0.0, 0.0, 0.7)


@pytest.mark.parametrize("velocity", [(0.5, 0.0, 0.0), (0.2, -0.1, 0.0), (-0.3, 0.0, 0.0)])
def test_a_follower_exerts_no_horizontal_force_on_average_wherever_the_robot_goes(robot, velocity):
    follower = Handle(robot, "follower")
    forces = follower.move(velocity, WALK, 6.0)
    assert np.abs(forces[100:, :2]).max() < 0.5, "at a constant velocity its aim stays with the handle"
    assert forces[100:, 2].mean() == pytest.approx(0.4 * MASS * 9.81, abs=0.5), "it carries its share"


def test_a_partner_on_the_path_pulls_a_robot_that_does_not_follow(robot):
    forces = Handle(robot, "path").move((0.0, 0.0, 0.0), WALK, 4.0)
    assert forces[100:, 0].mean() > 30.0


def test_a_leader_walks_at_its_own_pace(robot):
    half = Handle(robot, "leader", leader_pace=0.5, leader_sideways=0.0, leader_turning=0.0, leader_rise=0.0)
    forces = half.move((0.25, 0.0, 0.0), WALK, 6.0)
    assert np.abs(forces[100:, 0]).max() < LEAD, "who keeps its pace feels no pull"
    assert half.state.partner_velocity[0, :2] == pytest.approx([0.25, 0.0])
    assert half.move((0.5, 0.0, 0.0), WALK, 2.0)[-1, 0] < -20.0, "it holds back who is faster"


def test_a_leader_drifts_sideways_and_raises_its_hands_by_its_own_profile(robot):
    leader = Handle(robot, "leader", leader_pace=1.0, leader_sideways=0.1, leader_turning=0.0, leader_rise=0.05)
    forces = leader.move((0.5, 0.0, 0.0), WALK, 4.0)
    assert forces[-1, 1] > 5.0
    lift = forces[:, 2] - 0.4 * MASS * 9.81
    assert lift.max() > 3.0
    assert lift.min() < -3.0


def test_a_stopping_partner_stops_and_resumes(robot):
    stops = Handle(robot, "stopping", stopping_begin=2.0, stopping_duration=1.0, stopping_reverse=0.0)
    forces = stops.move((0.5, 0.0, 0.0), WALK, 6.0)[:, 0]
    assert np.abs(forces[60:99]).max() < LEAD
    assert forces[140:150].min() < -20.0, "it holds back who walks on"
    assert np.abs(forces[-20:]).max() < LEAD, "it comes back to the handle"


def test_a_tugging_partner_pulls_in_four_directions_in_turn(robot):
    forces = Handle(robot, "tugging").move((0.0, 0.0, 0.0), STAND, 8.0)
    pulls = forces[[10, 110, 210, 310], :2]
    assert pulls == pytest.approx(np.array([[40.0, 0.0], [0.0, 40.0], [-40.0, 0.0], [0.0, -40.0]]), abs=1e-6)
    assert np.abs(forces[[60, 160, 260, 360], :2]).max() < 1e-6, "between pulls nothing acts"


def test_a_lagging_partner_hears_the_command_late_and_hardly_damps(robot):
    lagging, usual = Handle(robot, "lagging"), Handle(robot, "path", partner_delay=0.1)
    assert lagging.partner._damping == pytest.approx(0.25 * usual.partner._damping)
    assert np.abs(lagging.move((0.0, 0.0, 0.0), WALK, 0.58)[:, 0]).max() < 1e-9
    assert lagging.move((0.0, 0.0, 0.0), WALK, 1.0)[-1, 0] > 10.0


def test_a_partner_whose_delay_is_not_drawn_hears_the_command_after_the_nominal_one(robot):
    slow = Recipe().delay.model_copy(update={"nominal": 1.0, "enabled": False})
    recipe = changed(SimulationSettings(), "partner.delay", slow)
    late = Handle(robot, "path", recipe=recipe, partner_delay=np.nan)
    assert np.abs(late.move((0.0, 0.0, 0.0), WALK, 0.98)[:, 0]).max() < 1e-9
    assert late.move((0.0, 0.0, 0.0), WALK, 0.5)[-1, 0] > 10.0


def test_an_absent_partner_intends_and_exerts_nothing(robot):
    absent = Handle(robot, "leader", share=0.0)
    assert not absent.move((0.5, 0.0, 0.0), WALK, 1.0).any()
    assert not absent.state.partner_velocity.any()


def test_training_draws_behaviours_by_their_shares_and_never_those_of_evaluation(robot):
    shares = Behaviours(path=0.0, follower=3.0, leader=1.0, stopping=0.0)
    recipe = changed(SimulationSettings(), "partner.behaviours", shares)
    n = 4000
    draws = Draws(recipe, [recipe.scenes.lift] * n, robot)
    draws.draw(np.arange(n), np.arange(n, dtype=np.uint64), {})
    counts = np.bincount(draws.values["partner_behaviour"].astype(int), minlength=len(BEHAVIOURS)) / n
    assert counts[[1, 2]] == pytest.approx([0.75, 0.25], abs=0.03)
    assert not counts[[0, 3, 4, 5]].any()
    assert set(Behaviours.model_fields) == set(BEHAVIOURS[:-2])


def test_behaviours_leave_all_other_draws_as_they_are(robot):
    recipe, key = SimulationSettings(), np.arange(50, dtype=np.uint64)
    drawn = []
    for shares in (Behaviours(), Behaviours(leader=2.0)):
        draws = Draws(changed(recipe, "partner.behaviours", shares), [recipe.scenes.lift] * 50, robot)
        draws.draw(np.arange(50), key, {})
        drawn.append({name: values.copy() for name, values in draws.values.items()})
    assert [name for name in drawn[0] if (drawn[0][name] != drawn[1][name]).any()] == ["partner_behaviour"]


def test_a_trial_holds_a_behaviour_by_name():
    held = TypeAdapter(Held)
    assert held.validate_python({"partner_behaviour": "lagging"}) == {"partner_behaviour": 5.0}
    with pytest.raises(ValidationError, match="no partner behaviour 'leading'; valid: path, follower"):
        held.validate_python({"partner_behaviour": "leading"})
    assert {"partner_behaviour", "leader_pace", "stopping_begin"} <= set(HOLDABLE)


def test_a_recipe_without_any_behaviour_is_refused():
    with pytest.raises(ValidationError, match="at least one of them a positive share"):
        Recipe(behaviours={"path": 0.0})
