"""Laws of mechanics, held against what the simulation reports."""

import mujoco
import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe

GRAVITY = 9.81


def test_energy_is_conserved_in_free_fall_and_lost_height_is_gained_speed(start, calm):
    simulation = start(calm, ["free"])
    model, data = simulation.physics_model(0)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION.value
    model.opt.timestep = 0.001
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY.value
    data.qpos[2] += 5.0
    data.qvel[6:35] = np.linspace(-1.0, 1.0, 29)
    mujoco.mj_forward(model, data)
    mass = model.body_subtreemass[1]
    before, height, speed = data.energy.sum(), data.subtree_com[1, 2], _robot_velocity(model, data)[2]
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert data.energy.sum() == pytest.approx(before, abs=0.003 * mass * GRAVITY * 1.2)
    fallen = speed * 0.5 - 0.5 * GRAVITY * 0.25
    assert data.subtree_com[1, 2] - height == pytest.approx(fallen, abs=0.02)


def _robot_velocity(model, data):
    mujoco.mj_subtreeVel(model, data)
    return data.subtree_linvel[1].copy()


@pytest.mark.parametrize("mass", [1.0, 4.0, 8.0])
def test_weight_of_robot_and_held_object_arrives_at_the_feet(start, by_hands, hold_base, mass):
    hold_base(vertical_free=True)
    simulation = start(by_hands, ["lift"], object_mass=mass)
    run(simulation, 200)
    model, _ = simulation.physics_model(0)
    state = simulation.state
    assert state.foot_force[0, :, 2].sum() == pytest.approx(model.body_mass.sum() * GRAVITY, rel=0.01)
    assert state.grip_force[0, :, 2].sum() == pytest.approx(-mass * GRAVITY, rel=0.01)
    assert state.foot_contact.all()


def test_static_torques_with_a_held_mass_equal_inverse_dynamics(start, calm, hold_base):
    hold_base()
    loose = changed(changed(calm, "scenes.lift.grasp.by_friction", 0.0), "scenes.lift.grasp.stiffness", 0.0)
    simulation = start(loose, ["lift"], object_mass=6.0)
    run(simulation, 250)
    model, data = simulation.physics_model(0)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    torque = data.qfrc_bias[6:35].copy()  # gravity of the robot alone
    jacobian = np.zeros((3, model.nv))
    for hand, force in zip(("left_grip", "right_grip"), simulation.state.grip_force[0], strict=True):
        mujoco.mj_jacSite(model, data, jacobian, None, model.site(hand).id)
        torque -= jacobian[:, 6:35].T @ force
    arms = simulation.robot.interaction
    assert np.allclose(simulation.state.joint_torque[0, arms], torque[arms], atol=0.1)


def test_eight_kilograms_stay_within_the_torque_of_the_wrists(start, calm, hold_base):
    hold_base()
    simulation = start(calm, ["lift"], object_mass=8.0)
    run(simulation, 200)
    wrists = [
        index for index, name in enumerate(simulation.robot.joints) if "wrist_pitch" in name or "wrist_yaw" in name
    ]
    assert np.all(np.abs(simulation.state.joint_torque[0, wrists]) < 0.8 * simulation.robot.effort[wrists])
    assert not simulation.state.saturation.any()


@pytest.mark.parametrize("body_contact", ["nothing", "object", "everything"])
def test_hands_push_the_crate_with_what_it_resists(start, calm, hold_base, robot, body_contact):
    hold_base()
    recipe = changed(changed(calm, "scenes.push.gap", 0.0), "physics.body_contact", body_contact)
    simulation = start(recipe, ["push"], object_mass=60.0, object_ground_friction=0.05)
    elbows = [index for index, name in enumerate(robot.joints) if "shoulder_pitch" in name]
    before = simulation.state.object_position[0, 0]
    forces = []
    for step in range(100):
        simulation.target[:, elbows] -= 0.003
        simulation.step()
        if step > 50 and simulation.state.object_linear_velocity[0, 0] > 0.01:
            forces.append(-simulation.state.grip_force[0, :, 0].sum())
    assert simulation.state.object_position[0, 0] > before + 0.02
    assert np.mean(forces) == pytest.approx(0.05 * 60.0 * GRAVITY, rel=0.25)


def test_hands_slip_at_the_slip_force_and_not_below(start, calm, hold_base, monkeypatch):
    hold_base()
    simulation = start(calm, ["lift"], object_mass=2.0, surface_friction=1.0)
    run(simulation, 50)
    slip = simulation.drawn["slip_force"][0]
    assert slip == pytest.approx(calm.scenes.lift.grasp.strength)
    pull, carried = [0.0], 0.0

    def pull_down(commanded, gust, state, out):
        pull[0] += 1.0
        out[:] = 0.0
        out[:, 2] = -pull[0]

    monkeypatch.setattr(simulation.partner, "wrench", pull_down)
    while not simulation.state.slipped.any():
        carried = np.linalg.norm(simulation.state.grip_force[0], axis=1).max()
        simulation.step()
        assert pull[0] < 4.0 * slip
    assert carried == pytest.approx(slip, rel=0.02)
    run(simulation, 50)
    assert not simulation.state.grasped.any()
    assert simulation.state.object_position[0, 2] < 0.3


def test_squeezed_box_is_held_up_to_what_friction_bears(start, by_hands, hold_base):
    hold_base()
    masses = np.array([2.0, 7.0, 16.0])
    simulation = start(by_hands, ["squeeze"] * 3, object_mass=masses, surface_friction=1.0)
    run(simulation, 60)
    height = simulation.state.object_position[:, 2].copy()
    run(simulation, 100)
    sunk = height - simulation.state.object_position[:, 2]
    assert np.all(sunk[:2] < 0.02)
    assert np.array_equal(simulation.state.grasped.all(axis=1), [True, True, False])
    weight = -simulation.state.grip_force[:2, :, 2].sum(axis=1)
    assert np.allclose(weight, masses[:2] * GRAVITY, rtol=0.03)


def test_body_contact_keeps_a_box_out_of_the_torso(start, calm, hold_base, monkeypatch):
    hold_base()
    nearest = []
    for body_contact in ("nothing", "object"):
        simulation = start(changed(calm, "physics.body_contact", body_contact), ["lift"], object_mass=4.0)

        def push_back(commanded, gust, state, out):
            out[:] = 0.0
            out[:, 0] = -80.0

        monkeypatch.setattr(simulation.partner, "wrench", push_back)
        run(simulation, 100)
        nearest.append(simulation.state.object_position[0, 0] - simulation.state.base_position[0, 0] - 0.15)
    assert nearest[0] < 0.05
    assert nearest[1] > 0.07


def test_explicit_and_implicit_joint_control_agree_where_both_are_stable(start, calm, hold_base):
    hold_base()
    heights = []
    for kind in ("implicit", "explicit"):
        simulation = start(
            changed(changed(calm, "physics.timestep", 0.002), "physics.pd", kind), ["lift"], object_mass=5.0
        )
        run(simulation, 150)
        heights.append(simulation.state.object_position[0, 2])
    assert heights[0] == pytest.approx(heights[1], abs=0.001)


def test_system_velocity_is_momentum_over_mass(start):
    simulation = start(Recipe(), ["free", "lift", "tyre", "push"])
    run(simulation, 15)
    for env in range(4):
        model, data = simulation.physics_model(env)
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        momentum = model.body_mass[1:, None] * _body_velocities(model, data)
        velocity = momentum.sum(axis=0) / model.body_mass.sum()
        assert np.allclose(simulation.state.system_velocity[env], velocity, atol=1e-9)
        assert np.allclose(simulation.state.com_position[env], data.subtree_com[1], atol=1e-12)


def _body_velocities(model, data):
    velocities, spatial = [], np.zeros(6)
    for body in range(1, model.nbody):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, spatial, 0)
        arm = data.xipos[body] - data.xpos[body]
        velocities.append(spatial[3:] + np.cross(spatial[:3], arm))
    return np.array(velocities)


def test_state_after_a_step_is_that_of_the_new_position_and_velocity(start):
    simulation = start(Recipe(), ["lift", "push"])
    run(simulation, 12)
    state = simulation.state
    for env in range(2):
        model, data = simulation.physics_model(env)
        mujoco.mj_forward(model, data)
        velocity = np.zeros(6)
        for foot, name in enumerate(("left_sole", "right_sole")):
            site = model.site(name).id
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site, velocity, 0)
            assert np.allclose(state.foot_position[env, foot], data.site_xpos[site], atol=1e-12)
            assert np.allclose(state.foot_velocity[env, foot], velocity[3:], atol=1e-9)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, model.body("object").id, velocity, 0)
        assert np.allclose(state.object_angular_velocity[env], velocity[:3], atol=1e-9)
        assert np.allclose(state.object_linear_velocity[env], velocity[3:], atol=1e-9)
        assert np.allclose(state.torso_rotation[env].ravel(), data.body("torso_link").xmat, atol=1e-12)


def test_forces_on_feet_and_hands_are_the_contact_forces(start, calm, hold_base):
    hold_base(vertical_free=True)
    simulation = start(calm, ["squeeze"], object_mass=3.0)
    run(simulation, 80)
    model, data = simulation.physics_model(0)
    mujoco.mj_forward(model, data)
    total = {}
    for index in range(data.ncon):
        contact, force = data.contact[index], np.zeros(6)
        mujoco.mj_contactForce(model, data, index, force)
        world = contact.frame.reshape(3, 3).T @ force[:3]
        for geom, sign in zip(contact.geom, (-1.0, 1.0), strict=True):
            body = model.geom_bodyid[geom]
            total[body] = total.get(body, 0.0) + sign * world
    feet = [total[model.body(name).id] for name in ("left_ankle_roll_link", "right_ankle_roll_link")]
    hands = [total[model.body(name).id] for name in ("left_hand", "right_hand")]
    assert np.allclose(simulation.state.foot_force[0], feet, atol=2.0)
    assert np.allclose(simulation.state.grip_force[0], hands, atol=2.0)


@pytest.mark.parametrize(("push", "friction", "first", "last"), [(0.0, 1.0, 48, 58), (60.0, 0.2, 0, 12)])
def test_feet_slide_as_their_loaded_points_do(start, calm, push, friction, first, last):
    simulation = start(calm, ["free"], ground_friction=friction)
    simulation.planned_push[:] = (push, 0.3 * push, 0.0)
    slid = points = 0.0
    run(simulation, first)
    for _ in range(first, last):
        simulation.step()
        model, data = simulation.physics_model(0)
        mujoco.mj_forward(model, data)
        for foot, name in enumerate(("left_ankle_roll_link", "right_ankle_roll_link")):
            moved, load = sliding_points(model, data, model.body(name).id)
            if load > 50.0:
                slid += simulation.soles["foot_slide"][0, foot]
                points += np.hypot(*moved[:2]) / load
    assert slid == pytest.approx(points, rel=0.1)
    assert slid > 0.5


def test_a_planned_impulse_acts_on_the_object_in_full(start, calm):
    blow, apart = (20.0, -10.0, 0.0), []
    for force in ((0.0, 0.0, 0.0), blow):
        simulation = start(calm, ["push"], object_mass=40.0)
        simulation.planned_impulse[0] = force
        simulation.step()
        assert np.allclose(simulation.impulse_force(0), force)
        apart.append(simulation.state.external_force[0, :3].copy())
    assert np.allclose(apart[1] - apart[0], blow)


def sliding_points(model, data, body):
    """Sum over a body's contacts of normal force times velocity (3,), and of the force [N]."""
    moved, load, force, jacobian = np.zeros(3), 0.0, np.zeros(6), np.zeros((3, model.nv))
    for index in range(data.ncon):
        contact = data.contact[index]
        if body in model.geom_bodyid[contact.geom]:
            mujoco.mj_contactForce(model, data, index, force)
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
            moved += force[0] * (jacobian @ data.qvel)
            load += force[0]
    return moved, load


def test_reset_puts_the_soles_on_the_ground_and_the_object_between_the_hands(start, calm):
    simulation = start(calm, ["lift", "push"])
    assert np.allclose(simulation.state.foot_position[..., 2], 0.0, atol=1e-3)
    hands = simulation.hand_position(0).mean(axis=0)
    grasp = calm.scenes.lift.grasp
    assert np.allclose(simulation.state.object_position[0], hands - [0.0, 0.0, grasp.height], atol=1e-9)
    face = simulation.state.object_position[1, 0] - 0.5 * calm.scenes.push.object.size[0]
    assert face > simulation.hand_position(1)[:, 0].max()
    assert np.allclose(simulation.state.grip_force, 0.0, atol=1e-6)
