"""Impulses on the object and pushes on the base."""

import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe


def test_an_impulse_brings_its_momentum(start, calm):
    recipe = changed(calm, "impulses.enabled", True)
    simulation = start(recipe, ["lift"] * 16)
    total, sizes = np.zeros((16, 3)), []
    for _ in range(220):
        before = simulation.state.external_force[:, :3].copy()
        simulation.step()
        force = simulation.state.external_force[:, :3].copy()
        force[:, 2] -= np.where(simulation.clock <= 25, _handed(simulation), 0.0)
        total += force * simulation.period
        ended = (np.abs(force).sum(axis=1) < 1e-9) & (np.abs(before).sum(axis=1) > 1e-9)
        sizes.extend(np.linalg.norm(total[ended], axis=1))
        total[ended] = 0.0
    sizes = [size for size in sizes if size > 1e-6]
    assert sizes
    assert all(0.99 <= size <= 8.01 for size in sizes)


def _handed(simulation):
    left = np.maximum(1.0 - (simulation.clock - 1) / 25.0, 0.0)
    return left * simulation.drawn["object_mass"] * 9.81


def test_a_push_would_change_the_velocity_of_the_whole_robot_by_its_speed(start, calm):
    simulation = start(changed(calm, "pushes.enabled", True), ["free"] * 32)
    model, _ = simulation.physics_model(0)
    gained = np.zeros((32, 3))
    for _ in range(260):
        simulation.step()
        gained += simulation.state.push_force * simulation.period / model.body_subtreemass[1]
        if simulation.clock[0] % 130 == 0:
            break
    speed = np.linalg.norm(gained, axis=1)
    struck = speed > 0.0
    assert struck.any()
    assert np.all(speed[struck] <= 0.5 + 1e-9)
    assert np.all(gained[:, 2] == 0.0)


def test_scale_zero_switches_blows_off(start):
    simulation = start(Recipe(), ["lift"] * 8, impulse_scale=0.0, push_scale=0.0, partner_share=0.0)
    for _ in range(120):
        simulation.step()
        assert np.all(simulation.state.push_force == 0.0)
    assert np.all(simulation.state.external_force == 0.0)


def test_handing_over_a_box_adds_no_force_to_a_crate_or_to_nothing(start, calm):
    simulation = start(calm, ["lift", "push", "free"])
    simulation.step()
    assert simulation.state.external_force[0, 2] > 50.0
    assert not simulation.state.external_force[1:].any()


def test_no_impulse_strikes_where_there_is_no_object(start, calm):
    simulation = start(changed(calm, "impulses.enabled", True), ["free"] * 8)
    for _ in range(220):
        simulation.step()
        assert not simulation.state.external_force.any()


def test_blows_come_at_different_times_in_different_environments(start, calm):
    simulation = start(changed(calm, "pushes.enabled", True), ["free"] * 16)
    first = np.zeros(16)
    for step in range(250):
        simulation.step()
        first = np.where((first == 0) & (np.abs(simulation.state.push_force).sum(axis=1) > 0), step, first)
    assert np.all(first >= 99)
    assert len(np.unique(first)) > 8


def test_partner_follows_the_commanded_motion_after_its_delay(start, calm, hold_base):
    hold_base()
    recipe = changed(calm, "partner.enabled", True)
    held = {"partner_share": 0.3, "partner_noise": 0.0, "partner_delay": 0.2, "partner_pace": 1.0}
    simulation = start(recipe, ["lift"], object_mass=7.0, **held)
    run(simulation, 60)
    rest = simulation.state.partner_force[0, 0]
    simulation.feed[:, :3] = (0.4, 0.0, 0.0)
    run(simulation, 10)
    assert simulation.state.partner_force[0, 0] == pytest.approx(rest, abs=0.5)
    run(simulation, 3)
    assert simulation.state.partner_force[0, 0] > rest + 5.0
    run(simulation, 100)
    assert simulation.state.partner_force[0, 0] <= recipe.partner.strongest


@pytest.mark.parametrize(("share", "sign"), [(0.5, 1.0), (-0.3, -1.0)])
def test_partner_helps_or_resists_a_push_with_its_share_of_the_resistance(start, calm, hold_base, share, sign):
    hold_base()
    recipe = changed(changed(calm, "partner.enabled", True), "scenes.push.gap", 0.5)
    held = {
        "object_mass": 50.0,
        "object_ground_friction": 0.1,
        "partner_share": share,
        "partner_noise": 0.0,
        "partner_share_drift": 0.0,
    }
    simulation = start(recipe, ["push"], partner_stiffness=0.0, partner_damping=0.0, **held)
    simulation.feed[:, :3] = (0.3, 0.0, 0.0)
    run(simulation, 30)
    assert simulation.state.partner_force[0, 0] == pytest.approx(share * 0.1 * 50.0 * 9.81, rel=0.01)
    assert np.sign(simulation.state.partner_force[0, 0]) == sign
    assert abs(simulation.state.object_linear_velocity[0, 0]) < 0.01


def test_energy_of_the_partner_is_force_times_way(start, calm, hold_base):
    hold_base()
    recipe = changed(changed(calm, "partner.enabled", True), "scenes.push.gap", 1.0)
    held = {
        "object_mass": 50.0,
        "object_ground_friction": 0.05,
        "partner_share": 0.8,
        "partner_noise": 0.0,
        "partner_share_drift": 0.0,
    }
    recipe = changed(recipe, "partner.push_yielding", 1.0)
    simulation = start(recipe, ["push"], **held)
    begin, handle = simulation.state.object_position[0, 0], simulation.partner.at
    simulation.feed[:, :3] = (0.3, 0.0, 0.0)
    displacements, work = [], 0.0
    for _ in range(60):
        run(simulation, 1)
        displacements.append(simulation.partner.handle_displacement.copy())
        work += float(simulation.state.partner_force[0] @ displacements[-1][0])
    way = simulation.state.object_position[0, 0] - begin
    assert way > 0.1
    assert np.sum(displacements, axis=0) == pytest.approx(simulation.partner.at - handle, abs=1e-12)
    assert work == pytest.approx(simulation.state.partner_force[0, 0] * way, rel=0.02)


def test_light_object_does_not_oscillate_on_a_stiff_partner(start, calm, hold_base):
    hold_base()
    held = {"object_mass": 0.3, "partner_share": 0.5, "partner_stiffness": 600.0, "partner_damping": 100.0}
    simulation = start(changed(calm, "partner.enabled", True), ["lift"], partner_noise=0.0, **held)
    run(simulation, 200)
    assert np.abs(simulation.state.object_linear_velocity).max() < 0.02
