"""What motors can give, and what their controllers take for true."""

import dataclasses

import mujoco
import numpy as np
import pytest
from changes import changed
from stepping import run

from iowbc.recipe.simulation.simulation import Physics
from iowbc.sim.drives import Drives
from iowbc.sim.simulation import Simulation
from iowbc.sim.state import SimulationState


@pytest.fixture
def drives(robot):
    """Motors of one robot at nominal strength, and the state that they look at."""
    made = Drives(robot, Physics(), 1)
    strong = {
        "motor_strength": np.ones((1, len(robot.joints))),
        "linkage_effort": np.full((1, len(robot.linkages)), 50.0),
    }
    made.reset(np.arange(1), strong)
    return made, SimulationState(1, len(robot.joints))


def test_torque_falls_with_speed_when_driving_and_not_when_braking(robot, drives):
    motors, state = drives
    knee = robot.joints.index("left_knee_joint")
    for part, left in ((0.0, 1.0), (0.6, 1.0), (0.8, 0.5), (1.0, 0.0), (1.2, 0.0)):
        state.joint_velocity[0, knee] = part * robot.velocity_limit[knee]
        low, high = motors.ranges(state.joint_position, state)[0, knee]
        assert high == pytest.approx(139.0 * left)
        assert low == pytest.approx(-139.0)


def test_pitch_and_roll_of_one_linkage_share_its_torque(robot, drives):
    motors, state = drives
    pitch, roll = (robot.joints.index(f"left_ankle_{axis}_joint") for axis in ("pitch", "roll"))
    target = state.joint_position.copy()
    target[0, pitch] = 20.0 / robot.kp[pitch]
    ranges = motors.ranges(target, state)[0, :, 1]
    assert ranges[[pitch, roll]] == pytest.approx([50.0, 30.0])
    target[0, pitch], target[0, roll] = 60.0 / robot.kp[pitch], -40.0 / robot.kp[roll]
    ranges = motors.ranges(target, state)[0, :, 1]
    assert ranges[[pitch, roll]] == pytest.approx([30.0, 20.0])


def test_weaker_motors_saturate_earlier(start, calm, hold_base):
    hold_base()
    simulation = start(calm, ["free"] * 2, motor_strength=[1.0, 0.85])
    elbow = simulation.robot.joints.index("left_elbow_joint")
    simulation.target[:, elbow] += 2.0
    simulation.step()
    assert simulation.state.saturation[:, elbow].all()
    assert np.abs(simulation.state.joint_torque[:, elbow]) == pytest.approx([25.0, 21.25])
    assert simulation.state.torque_limit[:, elbow] == pytest.approx([25.0, 21.25])


def test_a_biased_encoder_moves_the_joint_and_not_its_reading(start, calm, hold_base):
    hold_base()
    simulation = start(calm, ["free"] * 2, encoder_bias=[0.0, 0.015])
    run(simulation, 200)
    arms = simulation.robot.interaction
    positions, readings = simulation.state.joint_position[:, arms], simulation.measured.joint_position[:, arms]
    assert np.allclose(positions[1] - positions[0], -0.015, atol=2e-3)
    assert np.allclose(readings[1], readings[0], atol=2e-3)


def test_half_a_period_of_latency_switches_targets_in_the_middle_of_the_period(start, calm):
    late, model_of = start(calm, ["free"], action_latency=0.5), start(calm, ["free"], action_latency=0.0)
    run(late, 3), run(model_of, 3)
    model, data = model_of.physics_model(0)
    mujoco.mj_forward(model, data)
    old = late.target[0].copy()
    late.target[0, :15] += 0.05
    late.step()
    for target in (old, late.target[0]):
        data.ctrl[:] = target
        mujoco.mj_step(model, data, 2)
    assert np.allclose(late.state.joint_position[0], data.qpos[7:36], atol=1e-9)


def test_explicit_joint_control_at_a_step_that_buzzes_is_refused_with_the_longest_that_does_not(robot, calm):
    explicit = changed(calm, "physics.pd", "explicit")
    with pytest.raises(
        ValueError, match=r"wrist.*it must not pass 1; choose simulation\.physics\.timestep: 0\.00\d+ or"
    ):
        Simulation(robot, explicit, envs=np.arange(1), seed=0, scenes=["free"])
    stable = changed(explicit, "physics.timestep", 0.002)
    Simulation(robot, stable, envs=np.arange(1), seed=0, scenes=["free"])


def test_weak_motors_weaken_the_linkages_that_they_move(robot):
    motors = Drives(robot, Physics(), 1)
    strength = np.full((1, len(robot.joints)), 0.8)
    motors.reset(np.arange(1), {"motor_strength": strength, "linkage_effort": np.full((1, len(robot.linkages)), 40.0)})
    assert motors.effort[0, robot.linkages] == pytest.approx(32.0)
    others = np.setdiff1d(np.arange(len(robot.joints)), robot.linkages)
    assert motors.effort[0, others] == pytest.approx(0.8 * robot.effort[others])


def test_a_robot_with_a_single_linkage_draws_its_limit_in_every_environment(robot, calm):
    one = dataclasses.replace(robot, linkages=robot.linkages[:1])
    simulation = Simulation(one, calm, envs=np.arange(3), seed=0, scenes=["free"] * 3)
    simulation.reset(np.arange(3), np.tile(one.default_position, (3, 1)))
    drawn = simulation.drawn["linkage_effort"]
    assert drawn.shape == (3,)
    assert simulation.motor_effort[:, one.linkages[0]] == pytest.approx(np.stack([drawn, drawn], axis=1))
