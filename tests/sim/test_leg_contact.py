"""Legs and feet do not pass through each other."""

import mujoco
import numpy as np
import pytest
from changes import changed


def crossed(simulation, hip_roll):
    """The model, and data in which both legs turn inwards [rad]."""
    model, data = simulation.physics_model(0)
    data.qpos[2] += 1.0
    for side, sign in (("left", -1.0), ("right", 1.0)):
        data.joint(f"{side}_hip_roll_joint").qpos = sign * hip_roll
    mujoco.mj_forward(model, data)
    return model, data


def touching(model, data):
    """Pairs of bodies in contact."""
    return {frozenset(model.body(model.geom_bodyid[geom]).name for geom in contact.geom) for contact in data.contact}


@pytest.mark.parametrize("body_contact", ["nothing", "object", "everything"])
def test_feet_that_cross_meet(start, calm, body_contact):
    simulation = start(changed(calm, "physics.body_contact", body_contact), ["free"])
    model, data = crossed(simulation, 0.17)
    assert frozenset(("left_ankle_roll_link", "right_ankle_roll_link")) in touching(model, data)


def test_thighs_and_shins_that_cross_meet_each_other_and_the_other_foot(start, calm):
    model, data = crossed(start(calm, ["free"]), 0.25)
    for pair in (
        ("left_knee_link", "right_knee_link"),
        ("left_hip_yaw_link", "right_hip_yaw_link"),
        ("left_hip_yaw_link", "right_knee_link"),
        ("left_ankle_roll_link", "right_knee_link"),
        ("left_knee_link", "right_ankle_roll_link"),
    ):
        assert frozenset(pair) in touching(model, data), pair


def test_feet_are_pushed_apart_and_do_not_pass(start, calm):
    simulation = start(calm, ["free"])
    model, data = crossed(simulation, 0.09)
    model.opt.gravity[:] = 0.0
    for side, sign in (("left", -1.0), ("right", 1.0)):
        data.ctrl[model.actuator(f"{side}_hip_roll_joint").id] = sign * 0.3
    for _ in range(200):
        mujoco.mj_step(model, data)
    apart = data.site("left_sole").xpos[1] - data.site("right_sole").xpos[1]
    assert apart > 0.02
    assert frozenset(("left_ankle_roll_link", "right_ankle_roll_link")) in touching(model, data)


def test_a_leg_does_not_touch_itself_and_legs_apart_touch_nothing(start, calm):
    model, data = crossed(start(calm, ["free"]), 0.0)
    assert not touching(model, data)


def test_without_leg_contact_feet_pass(start, calm):
    model, data = crossed(start(changed(calm, "physics.leg_contact", False), ["free"]), 0.17)
    assert not touching(model, data)


def test_a_foot_meets_the_crate_above_its_wheels(start, calm):
    simulation = start(changed(calm, "scenes.push.gap", 0.0), ["push"])
    model, data = simulation.physics_model(0)
    data.joint("left_hip_pitch_joint").qpos = -0.9
    mujoco.mj_forward(model, data)
    data.joint("object_x").qpos = data.site("left_sole").xpos[0] + 0.40
    mujoco.mj_forward(model, data)
    assert frozenset(("left_ankle_roll_link", "object")) in touching(model, data)
    assert np.all(np.isfinite(data.qacc))
