"""Two who carry or push one object: statics of grips and handle, and the path that the second one keeps."""

import mujoco
import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.robot import rotations

GRAVITY = 9.81
STEADY = {"partner_noise": 0.0, "partner_share_drift": 0.0, "partner_pace": 1.0, "partner_delay": 0.1}


@pytest.fixture
def carried(start, by_hands, hold_base):
    """Makes a base that stays and an object carried with a partner."""

    def make(scenes, recipe=by_hands, **held):
        hold_base()
        return start(changed(recipe, "partner.enabled", True), scenes, **(STEADY | held))

    return make


@pytest.mark.parametrize(("scene", "mass"), [("lift", 7.0), ("tyre", 12.0)])
@pytest.mark.parametrize("share", [0.2, 0.4])
def test_grips_and_handle_carry_what_the_lever_arms_say(carried, scene, mass, share):
    simulation = carried([scene], object_mass=mass, partner_share=share, partner_stiffness=0.0)
    run(simulation, 400)
    state, recipe = simulation.state, simulation.recipe
    up = -state.grip_force[0, :, 2].sum()
    handle = state.partner_force[0, 2]
    assert up + handle == pytest.approx(mass * GRAVITY, rel=0.01)
    hands = simulation.hand_position(0).mean(axis=0)
    ahead = rotations.rotate_inverse(
        state.object_quaternion[:1], np.stack([simulation.partner.at[0] - hands, state.object_position[0] - hands])
    )
    about_hands = handle * ahead[0, 0] - mass * GRAVITY * ahead[1, 0]
    limit = 2.0 * 0.02 * simulation.drawn["slip_force"][0]
    assert abs(about_hands) < limit
    half = 0.5 * getattr(recipe.scenes, scene).object.size[0]
    assert simulation.drawn["grip_shift"][0] == pytest.approx(half * share / (1.0 - share))
    assert handle / (mass * GRAVITY) == pytest.approx(share, abs=0.01)


def test_unbalanced_moments_turn_the_object_until_the_palms_bear_them(carried, by_hands):
    middle = changed(by_hands, "scenes.lift.grasp.near_end", 0.0)
    simulation = carried(["lift"], recipe=middle, object_mass=7.0, partner_share=0.3, partner_stiffness=0.0)
    run(simulation, 400)
    grip = simulation.world_of(0)[0]._grip
    moment = 0.3 * 7.0 * GRAVITY * 0.15
    pitch = np.arcsin(
        -2.0
        * (
            simulation.state.object_quaternion[0, 1] * simulation.state.object_quaternion[0, 3]
            - simulation.state.object_quaternion[0, 0] * simulation.state.object_quaternion[0, 2]
        )
    )
    hanging = 0.7 * 7.0 * GRAVITY * 0.08 * np.sin(abs(pitch))
    assert abs(4.0 * grip.angle[0]) + hanging == pytest.approx(moment, rel=0.25)


def test_palms_damp_what_turns_against_them_and_not_what_turns_with_them(start, by_hands, hold_base):
    hold_base()
    simulation = start(by_hands, ["lift"], object_mass=4.0)
    world = simulation.world_of(0)[0]
    grip, layout = world._grip, world.layout
    hands = grip._sites[0, layout.grips]
    axis = (hands[0] - hands[1]) / np.linalg.norm(hands[0] - hands[1])
    grip._spatial = grip._spatial.copy()  # MuJoCo's own array takes no other numbers
    grip.angle[:], grip.rate[:] = 0.0, 0.0
    holding = np.array([4.0]), np.array([140.0]), np.ones((1, 2))
    grip._spatial[0, layout.hands, :3] = grip._spatial[0, layout.object, :3] = 0.2 * axis
    assert grip.twist(*holding)[0] == pytest.approx(np.zeros(3), abs=1e-9), "the robot turns with what it holds"
    grip._spatial[0, layout.hands, :3] = 0.0
    against = grip.twist(*holding)[0] @ axis
    assert against < 0.0
    assert abs(against) < 2.0 * 0.02 * 140.0, "below the torque at which the palms slip"


@pytest.mark.parametrize("mass", [0.05, 0.2, 1.0])
def test_a_light_object_comes_to_rest_between_the_palms(start, by_hands, hold_base, mass):
    hold_base()
    simulation = start(by_hands, ["lift"], object_mass=mass)
    run(simulation, 50)
    grip = simulation.world_of(0)[0]._grip
    grip.angle[:] += 0.05
    turning = []
    for _ in range(200):
        run(simulation, 1)
        turning.append(abs(grip.rate[0]))
    assert max(turning[:50]) > 0.05, "it was turned"
    assert max(turning[-50:]) < 0.05 * max(turning[:50])


def test_palms_are_as_stiff_on_a_light_box_as_the_recipe_says(start, by_hands, hold_base, monkeypatch):
    hold_base()
    simulation = start(by_hands, ["lift"], object_mass=0.05)

    def turn(commanded, gust, state, out):
        out[:] = 0.0
        out[:, 4] = 0.4

    monkeypatch.setattr(simulation.partner, "wrench", turn)
    run(simulation, 200)
    assert simulation.world_of(0)[0]._grip.angle[0] == pytest.approx(0.4 / 4.0, rel=0.1)


def test_palms_slip_at_their_torque_and_not_below(start, by_hands, hold_base, monkeypatch):
    hold_base()
    simulation = start(by_hands, ["lift"], object_mass=4.0, surface_friction=1.0)
    limit = 2.0 * 0.02 * 140.0
    turning = [0.0]

    def turn(commanded, gust, state, out):
        out[:] = 0.0
        out[:, 4] = turning[0]

    monkeypatch.setattr(simulation.partner, "wrench", turn)
    run(simulation, 60)
    turning[0] = -1.6 * limit
    run(simulation, 14)
    grip = simulation.world_of(0)[0]._grip
    assert abs(4.0 * grip.angle[0]) == pytest.approx(limit)


def test_partner_rises_with_the_commanded_height_after_its_delay(carried):
    simulation = carried(["lift"], object_mass=7.0, partner_share=0.4, partner_delay=0.2)
    simulation.feed[:, 3] = 0.7
    run(simulation, 100)
    rest = simulation.state.partner_force[0, 2]
    simulation.feed[:, 3] = 0.76
    run(simulation, 10)
    assert simulation.state.partner_force[0, 2] == pytest.approx(rest, abs=1.0)
    run(simulation, 60)
    assert simulation.state.partner_force[0, 2] > rest + 5.0


def test_partner_resists_a_robot_that_drifts_and_turns_without_a_command(carried):
    simulation = carried(["lift"], object_mass=7.0, partner_share=0.4)
    run(simulation, 60)
    rest = simulation.state.partner_force[0].copy()
    simulation.state.base_rotation[0] = rotations.matrix(rotations.from_euler(np.zeros(1), np.zeros(1), np.ones(1)))[0]
    simulation.partner._aim[0, 1] -= 0.05  # as after a drift of the object by 5 cm to the left
    run(simulation, 1)
    pulled = simulation.state.partner_force[0] - rest
    assert pulled[1] < -0.6 * 0.05 * simulation.drawn["partner_stiffness"][0]
    assert abs(pulled[0]) < 0.2 * abs(pulled[1])


def test_partner_turns_about_the_commanded_path(carried):
    simulation = carried(["lift"] * 2, object_mass=7.0, partner_share=0.4, start_yaw=[0.0, 2.0])
    simulation.feed[:, 2] = 0.5
    run(simulation, 100)
    heading = simulation.partner._heading
    turned = 0.5 * (2.0 - 0.1)
    assert heading == pytest.approx(np.array([[np.cos(a), np.sin(a)] for a in (turned, 2.0 + turned)]), abs=0.01)


def test_share_wanders_within_an_episode_by_its_deviation(carried):
    simulation = carried(["lift"] * 24, object_mass=7.0, partner_share=0.4, partner_share_drift=0.1)
    shares = []
    for _ in range(400):
        simulation.step()
        shares.append(simulation.state.partner_share.copy())
    shares = np.array(shares)[150:]
    assert shares.std() == pytest.approx(0.1, rel=0.3)
    assert np.all((shares >= 0.0) & (shares <= 1.0))
    assert np.abs(np.diff(shares, axis=0)).max() < 0.05


def test_partner_in_a_push_yields_around_its_share_and_its_noise_follows_the_resistance(start, calm, hold_base):
    hold_base()
    recipe = changed(changed(calm, "partner.enabled", True), "scenes.push.gap", 0.5)
    held = STEADY | {"object_mass": [25.0, 50.0], "object_ground_friction": 0.1, "partner_share": 0.4}
    simulation = start(recipe, ["push"] * 2, **held)
    simulation.feed[:, :3] = (0.3, 0.0, 0.0)
    run(simulation, 60)
    resistance = simulation.drawn["rolling_resistance"]
    heading = simulation.state.base_rotation[:, :2, 0]
    along = np.vecdot(simulation.state.partner_force[:, :2], heading)
    assert along == pytest.approx(0.4 * resistance * 1.5, rel=0.02)
    noisy = start(recipe, ["push"] * 2, **(held | {"partner_noise": 8.0}))
    assert noisy.partner._gust[1] == pytest.approx(2.0 * noisy.partner._gust[0])


def test_torque_of_the_partner_is_about_the_centre_of_mass(carried):
    simulation = carried(["lift"] * 2, object_mass=7.0, partner_share=0.4, object_com_offset=[0.0, 0.03])
    run(simulation, 50)
    arm = simulation.partner.at - simulation.state.object_position
    arm -= rotations.rotate(simulation.state.object_quaternion, simulation.drawn["object_com_offset"])
    force = simulation.state.external_force
    run(simulation, 1)
    assert np.allclose(force[:, 3:], np.cross(arm, force[:, :3]), atol=0.02)


def test_holding_by_friction_costs_the_arms_what_friction_needs(start, by_hands, hold_base):
    hold_base()
    loose = changed(by_hands, "scenes.lift.grasp.stiffness", 0.0)
    resting = start(changed(loose, "scenes.lift.grasp.by_friction", 0.0), ["lift"], object_mass=6.0)
    pressing = start(loose, ["lift"], object_mass=6.0)
    run(resting, 250), run(pressing, 250)
    assert np.allclose(pressing.state.joint_position, resting.state.joint_position, atol=2e-3)
    model, data = pressing.physics_model(0)
    mujoco.mj_forward(model, data)
    force = 0.5 * 6.0 * GRAVITY / pressing.drawn["surface_friction"][0]
    jacobian, expected = np.zeros((3, model.nv)), np.zeros(29)
    for hand, sign in (("left_grip", -1.0), ("right_grip", 1.0)):
        mujoco.mj_jacSite(model, data, jacobian, None, model.site(hand).id)
        side = data.site("left_grip").xpos - data.site("right_grip").xpos
        expected += jacobian[:, 6:35].T @ (sign * force * side / np.linalg.norm(side))
    arms = pressing.robot.interaction
    cost = (pressing.state.joint_torque - resting.state.joint_torque)[0, arms]
    assert np.abs(expected[arms]).max() > 3.0
    assert np.allclose(cost, expected[arms], atol=0.4)
