"""What is drawn for an episode, and that it reaches the models."""

import numpy as np
import pytest
from changes import changed
from pydantic import ValidationError

from iowbc.recipe.simulation.randomization import Distribution
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe

COUNT = 64


def test_draws_cover_the_ranges_of_table_one_and_light_loads(start):
    simulation = start(Recipe(), ["push"] * COUNT)
    for name, low, high in (
        ("object_mass_scale", 0.07, 1.5),
        ("ground_friction", 0.5, 1.2),
        ("object_ground_friction", 0.02, 0.15),
        ("surface_friction", 1.0, 1.5),
        ("start_yaw", -np.pi, np.pi),
    ):
        drawn = simulation.drawn[name]
        assert drawn.min() >= low
        assert drawn.max() <= high
        assert np.ptp(drawn) > 0.8 * (high - low)
    assert np.allclose(simulation.drawn["object_mass"], 65.0 * simulation.drawn["object_mass_scale"])
    ahead = (simulation.state.object_position - simulation.state.base_position)[:, :2]
    way = np.stack([np.cos(simulation.drawn["start_yaw"]), np.sin(simulation.drawn["start_yaw"])], axis=1)
    assert np.vecdot(ahead, way) == pytest.approx(np.linalg.norm(ahead, axis=1), rel=0.02), "the crate stands ahead"


def test_a_world_of_a_seed_stays_what_it_was(start):
    """A new quantity in the table of draws would change all others, and with them the worlds of published trials."""
    simulation = start(Recipe(), ["lift"], seed=2000)
    names = ("object_mass", "motor_strength", "sensor_latency", "partner_share", "partner_stiffness", "leader_pace")
    drawn = [float(simulation.drawn[name].flat[0]) for name in names]
    assert drawn == pytest.approx([4.21411457, 0.92236931, 0.391002457, 0.342353439, 257.907135, 0.073171637])


def test_every_episode_draws_anew(start, carrying):
    simulation = start(Recipe(), ["lift"] * 4)
    first = {name: values.copy() for name, values in simulation.drawn.items()}
    simulation.reset(np.array([1, 3]), np.tile(carrying, (2, 1)))
    again = simulation.drawn["object_mass"] == first["object_mass"]
    assert np.array_equal(again, [True, False, True, False])


def test_one_seed_meets_the_same_trial_in_any_environment(start):
    trials = [start(Recipe(), ["lift"] * 2, envs=[0, 0], seed=[8, 9]), start(Recipe(), ["lift"], envs=[0], seed=9)]
    for name, values in trials[1].drawn.items():
        assert np.array_equal(values[0], trials[0].drawn[name][1]), name


def test_held_quantities_are_not_drawn_and_nan_draws(start):
    masses = np.array([2.0, np.nan, 0.0])
    simulation = start(Recipe(), ["lift"] * 3, object_mass=masses, partner_share=0.0)
    drawn = simulation.drawn["object_mass"]
    assert drawn[0] == 2.0
    assert 0.07 * 7.0 <= drawn[1] <= 10.5
    assert drawn[2] == Recipe().scenes.lift.object.smallest_mass
    assert np.all(simulation.drawn["partner_share"] == 0.0)


def test_load_scale_lowers_the_upper_end_of_the_mass_range(start):
    simulation = start(Recipe(), ["lift"] * COUNT, load_scale=0.25)
    mass = simulation.drawn["object_mass"] / 7.0
    assert mass.min() >= 0.07
    assert 0.40 < mass.max() <= 0.07 + 0.25 * (1.5 - 0.07)


def test_holding_an_unknown_quantity_names_the_known_ones(start):
    with pytest.raises(KeyError, match=r"no randomised quantities \['mass'\]; there are: .*object_mass"):
        start(Recipe(), ["lift"], mass=2.0)


def test_without_randomisation_everything_is_nominal(start):
    simulation = start(changed(Recipe(), "randomization.enabled", False), ["lift"] * 8)
    assert np.all(simulation.drawn["object_mass"] == 7.0)
    assert np.all(simulation.drawn["kp_scale"] == 1.0)
    assert np.all(simulation.drawn["ground_friction"] == Recipe().randomization.ground_friction.nominal)


def test_drawn_values_reach_the_model(start, robot):
    simulation = start(Recipe(), ["lift", "push"])
    drawn = simulation.drawn
    for env in range(2):
        model, _ = simulation.physics_model(env)
        thing = model.body("object")
        assert thing.mass[0] == drawn["object_mass"][env]
        assert np.array_equal(thing.ipos, drawn["object_com_offset"][env])
        assert model.geom("left_foot_heel_outer").friction[0] == drawn["ground_friction"][env]
        assert model.body("torso_link").mass[0] == pytest.approx(7.818 * drawn["link_mass_scale"][env][15])
        assert np.allclose(model.actuator_gainprm[:, 0], robot.kp * drawn["kp_scale"][env])
        assert np.allclose(model.actuator_biasprm[:, 2], -robot.kd * drawn["kd_scale"][env])
        assert np.allclose(model.dof_damping[6:35], drawn["motor_damping"][env])
        assert np.allclose(model.dof_frictionloss[6:35], drawn["joint_friction"][env])
        assert model.body_subtreemass[0] == pytest.approx(model.body_mass.sum())
    model, _ = simulation.physics_model(1)
    resistance = drawn["object_ground_friction"][1] * drawn["object_mass"][1] * 9.81
    assert drawn["rolling_resistance"][1] == pytest.approx(resistance)
    assert drawn["rolling_resistance"][0] == 0.0
    assert model.geom("left_palm").friction[0] == drawn["surface_friction"][1]


def test_slip_force_is_surface_friction_times_the_strength_of_the_grasp(start):
    simulation = start(Recipe(), ["lift"] * 3)
    assert np.allclose(simulation.drawn["slip_force"], 140.0 * simulation.drawn["surface_friction"])


def test_latency_beyond_the_delay_line_names_the_recipe(start):
    with pytest.raises(ValueError, match=r"latency of 9 periods.*randomization\.longest_latency"):
        start(Recipe(), ["lift"], action_latency=9.0)


def test_a_share_of_the_objects_is_light(start):
    recipe = changed(Recipe(), "randomization.object_mass_scale.low", 0.05 / 7.0)
    recipe = changed(recipe, "randomization.light_share", 0.5)
    mass = start(recipe, ["lift"] * 400).drawn["object_mass"]
    light = mass < 0.7
    assert light.mean() == pytest.approx(0.5 + 0.5 * 0.65 / 10.45, abs=0.08)
    assert 0.05 <= mass.min() < 0.07, "down to the lower end"
    assert np.median(mass[light]) == pytest.approx(np.sqrt(0.05 * 0.7), rel=0.3), "evenly in the logarithm"


def test_what_is_not_drawn_is_neither_light_nor_slow(start):
    recipe = changed(changed(Recipe(), "randomization.light_share", 0.5), "randomization.slow_share", 0.5)
    for name in ("object_mass_scale", "action_latency", "sensor_latency"):
        recipe = changed(recipe, f"randomization.{name}.enabled", False)
    drawn = start(recipe, ["lift"] * 40).drawn
    assert np.ptp(drawn["object_mass"]) == np.ptp(drawn["action_latency"]) == np.ptp(drawn["sensor_latency"]) == 0.0


def test_a_share_of_the_episodes_has_both_latencies_long(start):
    def both(recipe):
        drawn = start(recipe, ["lift"] * 400).drawn
        return ((drawn["action_latency"] > 2.0 / 3.0) & (drawn["sensor_latency"] > 2.0 / 3.0)).mean()

    assert both(Recipe()) == pytest.approx(1.0 / 9.0, abs=0.05)
    slow = changed(Recipe(), "randomization.slow_share", 0.4)
    slow = changed(slow, "randomization.object_mass_scale.low", 0.0)  # which only light objects cannot have
    assert both(slow) == pytest.approx(0.4 + 0.6 / 9.0, abs=0.08)
    assert max(start(slow, ["lift"] * 400).drawn[f"{name}_latency"].max() for name in ("action", "sensor")) <= 1.0


def test_shares_of_uncommon_episodes_leave_the_others_as_they_are(start):
    usual = start(Recipe(), ["lift"] * COUNT).drawn
    slow = start(changed(Recipe(), "randomization.slow_share", 0.3), ["lift"] * COUNT).drawn
    same = usual["action_latency"] == slow["action_latency"]
    assert 0 < (~same).sum() < COUNT
    assert np.array_equal(usual["object_mass"], slow["object_mass"])


def test_the_loads_centre_is_held_along_one_axis_and_drawn_along_the_others(start):
    simulation = start(Recipe(), ["lift"] * COUNT, object_com_offset_y=0.08)
    offset = simulation.drawn["object_com_offset"]
    assert np.all(offset[:, 1] == 0.08)
    assert np.ptp(offset[:, 0]) > 0.03
    assert np.ptp(offset[:, 2]) > 0.03
    free = start(Recipe(), ["free"], object_com_offset_y=0.08)
    assert not free.drawn["object_com_offset"].any(), "nothing has a centre where there is no object"


def test_a_partner_who_is_not_enabled_bears_nothing_whatever_the_nominal_share(start):
    recipe = changed(Recipe(), "partner.enabled", False)
    for name in ("share", "push_share"):
        recipe = changed(recipe, f"partner.{name}", Distribution(low=0.0, high=0.6, nominal=0.5))
    assert (start(recipe, ["lift"] * 8 + ["push"] * 8).drawn["partner_share"] == 0.0).all()


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            {"randomization": {"light_share": 0.5, "object_mass_scale": {"low": 0, "high": 1, "nominal": 1}}},
            "light_share",
        ),
        ({"randomization": {"light_share": 0.5, "light_end": 0.01}}, "light_share"),
        ({"partner": {"damping": {"low": -1, "high": 1, "nominal": 0}}}, "partner.damping"),
        ({"partner": {"stopping": {"duration": {"low": 0, "high": 1, "nominal": -1}}}}, "stopping.duration"),
        ({"impulses": {"magnitude": {"low": -1, "high": 1, "nominal": 0}}}, "impulses.magnitude"),
        ({"pushes": {"interval": {"low": -1, "high": 1, "nominal": 0}}}, "pushes.interval"),
        (
            {"scenes": {"tyre": {"kind": "lift", "object": {"shape": "tyre", "size": [0.2, 0.5, 0.6], "mass": 9}}}},
            "tyre",
        ),
    ],
)
def test_ranges_that_nothing_can_have_are_refused(given, text):
    with pytest.raises(ValidationError, match=text.rpartition(".")[2]):
        Recipe.model_validate(given)
