"""What the soles do on the ground: peaks between two control steps, centre of pressure, speed before they touch."""

import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.robot.description import GRAVITY
from iowbc.sim.soles import half_planes


def test_the_peak_force_of_a_foot_is_seen_in_a_physics_step_that_is_not_the_last(start, calm):
    simulation = start(calm, ["free"])
    run(simulation, 50)
    last = np.linalg.norm(simulation.state.foot_force[0, 0])
    simulation.worlds[0].soles._past_force[0, 0, 1] = (0.0, 0.0, last + 500.0)
    peak = simulation.soles["foot_peak"][0]
    assert peak[0] == pytest.approx(last + 500.0)
    assert peak[1] < last + 500.0


def test_feet_at_rest_press_as_hard_in_every_physics_step_and_bear_the_weight(start, calm, hold_base):
    hold_base(vertical_free=True)
    simulation = start(calm, ["free", "lift"], object_mass=np.array([np.nan, 3.0]))
    run(simulation, 200)
    peak, last = simulation.soles["foot_peak"], simulation.state.foot_force
    assert peak == pytest.approx(np.linalg.norm(last, axis=2), rel=0.01)
    weight = GRAVITY * (simulation._robot_mass + np.array([0.0, 3.0]))
    assert last[..., 2].sum(axis=1) == pytest.approx(weight, rel=0.02)


def test_the_pressure_of_a_standing_robot_is_inside_its_soles_and_of_one_that_tips_at_their_edge(start, calm):
    simulation = start(calm, ["free"])
    run(simulation, 10)
    standing = simulation.soles["foot_margin"][0]
    assert np.all((standing > 0.0) & (standing < 0.03)), "a sole is 5 cm wide"
    simulation.planned_push[:] = (150.0, 0.0, 0.0)
    margins = []
    for _ in range(25):
        simulation.step()
        margins.append(simulation.soles["foot_margin"][0][simulation.state.foot_contact[0]])
    assert np.concatenate(margins).min() == 0.0


def test_soles_in_the_air_have_no_pressure_and_sink_as_what_falls(start, calm):
    simulation = start(calm, ["free"])
    simulation.worlds[0].qpos[0, 2] += 0.5
    run(simulation, 10)
    soles = simulation.soles
    assert not soles["foot_margin"].any()
    assert soles["foot_sink"][0] == pytest.approx([GRAVITY * 10 * simulation.period] * 2, rel=0.02)
    assert not soles["foot_peak"].any()


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_feet_that_slide_stop_sooner_with_a_shorter_time_constant(start, calm, cone):
    slides = []
    for time_constant in (0.01, 0.02, 0.04):
        feet = changed(changed(calm, "physics.cone", cone), "physics.foot_time_constant", time_constant)
        simulation = start(feet, ["free"])
        run(simulation, 10)
        simulation.worlds[0].qvel[0, 0] += 0.2
        slides.append(sum(_slide(simulation) for _ in range(5)))
    assert slides[0] < 0.5 * slides[1] < 0.25 * slides[2]


def _slide(simulation):
    """Distance that both soles slide in a control period [m]."""
    simulation.step()
    return simulation.soles["foot_slide"].sum() * simulation.period


def test_a_point_is_as_far_inside_a_polygon_as_its_nearest_side():
    square = np.array([[1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])
    normals, distances = half_planes(square)
    assert np.min(distances - normals @ np.array([0.7, -0.1])) == pytest.approx(0.3)
    assert np.min(distances - normals @ np.array([0.0, 1.5])) == pytest.approx(-0.5)
