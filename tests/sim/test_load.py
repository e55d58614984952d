"""Who carries a held object: the share of its weight in the hands, and what other links bear."""

import numpy as np
import pytest
from changes import changed
from stepping import run

GRAVITY = 9.81


@pytest.mark.parametrize(("scene", "mass"), [("lift", 5.0), ("lift", 0.05), ("squeeze", 5.0), ("tyre", 5.0)])
def test_hands_that_hold_an_object_alone_carry_all_of_its_weight(start, by_hands, hold_base, scene, mass):
    hold_base()
    simulation = start(by_hands, [scene], object_mass=mass)
    run(simulation, 200)
    assert simulation.state.hand_weight_share[0] == pytest.approx(1.0, abs=0.02)
    assert simulation.state.link_object_force[0] < 0.5


def test_a_box_pressed_against_the_torso_counts_as_force_of_links_and_not_of_hands(start, calm, hold_base, monkeypatch):
    hold_base()
    simulation = start(calm, ["lift"], object_mass=4.0)

    def push_back(commanded, gust, state, out):
        out[:] = 0.0
        out[:, 0] = -80.0

    monkeypatch.setattr(simulation.partner, "wrench", push_back)
    run(simulation, 150)
    hands = -simulation.state.grip_force[0].sum(axis=0)
    links = np.array([80.0, 0.0, 4.0 * GRAVITY]) - hands
    assert simulation.state.link_object_force[0] == pytest.approx(np.linalg.norm(links), abs=1.0)
    assert simulation.state.link_object_force[0] > 10.0


def test_nothing_and_a_crate_have_no_weight_in_the_hands(start, calm):
    simulation = start(calm, ["free", "push"])
    run(simulation, 20)
    assert not simulation.state.hand_weight_share.any()
    assert simulation.state.link_object_force[0] == 0.0


def test_a_hand_slips_at_a_peak_between_two_control_steps(start, calm, hold_base):
    hold_base()
    simulation = start(calm, ["lift"], object_mass=2.0)
    run(simulation, 50)
    world, _ = simulation.world_of(0)
    world._past_forces[0, 0, 1] = (0.0, 0.0, simulation.drawn["slip_force"][0] + 1.0)
    world.release(simulation.state, simulation.drawn["slip_force"])
    assert np.array_equal(simulation.state.slipped[0], [True, False])


def test_a_tyre_is_a_ring_through_whose_hole_things_pass(start, calm):
    simulation = start(changed(calm, "physics.body_contact", "object"), ["tyre"])
    model, _ = simulation.physics_model(0)
    geoms = [index for index in range(model.ngeom) if model.geom_bodyid[index] == model.body("object").id]
    nearest = min(np.linalg.norm(model.geom_pos[index][1:]) - model.geom_size[index][0] for index in geoms)
    assert nearest == pytest.approx(0.55 * 0.28, rel=0.03)
    assert all(model.geom_contype[index] for index in geoms)
