"""The simulated robot: what it does with commands, and without."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.commands.robot import _show
from iowbc.deploy.controller import Controller
from iowbc.errors import UsageError
from iowbc.evaluation.exported import exported_world
from iowbc.live.remote_view import Asked
from iowbc.onboard import messages
from iowbc.onboard.checks import SafetyLimits
from iowbc.onboard.machine import CycleInputs, Machine, OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.operators import Udp
from iowbc.onboard.process import PERIOD
from iowbc.onboard.ranges import Ranges
from iowbc.sim.rendering.forces import Force
from iowbc.twin.robot import SILENCE, Twin, object_tracking
from iowbc.twin.support import Support

pytestmark = pytest.mark.integration


@pytest.fixture
def twin(blind: Path, controller: Controller) -> Twin:
    posture = controller.settled_posture(Ranges(controller.contract).standing)[0]
    simulation = exported_world(blind).recipe.simulation
    fixed = {"impulse_scale": 0.0, "push_scale": 0.0}
    return Twin(controller.robot, simulation, 50.0, "free", 0, posture, Support("band", 100.0), fixed)


def holding(twin: Twin) -> Record:
    """Full gains about the posture of now."""
    command = messages.empty(messages.LOW_COMMAND)
    motors = command["motor_cmd"][:29]
    motors["mode"], motors["q"] = 1, twin.simulation.state.joint_position[0]
    motors["kp"], motors["kd"] = twin.robot.kp, twin.robot.kd
    command["crc"] = messages.checksum(command)
    return command


def test_the_band_holds_a_robot_whose_joints_only_hold_their_posture(twin: Twin) -> None:
    command = holding(twin)
    for _ in range(1500):
        twin.command(command)
        twin.step()
    assert not twin.fallen
    error = twin.simulation.state.joint_position[0] - command["motor_cmd"]["q"][:29]
    assert np.abs(error).max() < 0.3


def test_a_command_with_a_wrong_checksum_is_passed_over(twin: Twin) -> None:
    command = holding(twin)
    command["crc"] += 1
    twin.command(command)
    twin.step()
    assert not twin.simulation.state.joint_torque.any()


def test_motors_brake_once_commands_stay_away(twin: Twin) -> None:
    twin.command(holding(twin))
    for _ in range(round(SILENCE * 500) + 5):
        twin.step()
    twin.simulation.target[0] += 1.0
    twin.step()
    limit = 1.2 * twin.robot.kd * (np.abs(twin.simulation.state.joint_velocity[0]) + 0.5) + 1.0
    assert (np.abs(twin.simulation.state.joint_torque[0]) <= limit).all()


def test_a_stale_torque_does_not_outlast_the_commands(twin: Twin) -> None:
    command = holding(twin)
    command["motor_cmd"][15]["tau"] = 8.0
    command["crc"] = messages.checksum(command)
    twin.command(command)
    for _ in range(round(SILENCE * 500) + 250):
        twin.step()
    state = twin.simulation.state
    assert state.joint_torque[0, 15] * state.joint_velocity[0, 15] < 0.0, "it brakes"


def test_a_motor_without_gains_has_the_torque_of_its_command(twin: Twin) -> None:
    command = holding(twin)
    motors = command["motor_cmd"][:29]
    motors["kp"], motors["kd"], motors["tau"] = 0.0, 0.0, 2.0
    motors["kd"][0], motors["dq"][0], motors["tau"][0] = 1.0, 2.0, 0.0
    command["crc"] = messages.checksum(command)
    twin.command(command)
    twin.support = Support("band", 100.0)
    velocity = twin.simulation.state.joint_velocity[0].copy()
    twin.step()
    torque = twin.simulation.state.joint_torque[0]
    assert torque[1:] == pytest.approx(2.0, rel=0.2)
    assert torque[0] == pytest.approx(2.0 - velocity[0], rel=0.3)


def test_the_state_tells_what_the_sensors_deliver(twin: Twin) -> None:
    for _ in range(20):
        twin.step()
    state, seen = twin.state, twin.simulation.measured
    assert state["tick"] == 40
    assert state["crc"] == messages.checksum(state)
    np.testing.assert_allclose(state["motor_state"]["q"][:29], seen.joint_position[0], atol=1e-6)
    np.testing.assert_allclose(state["imu_state"]["gyroscope"], seen.base_angular_velocity[0], atol=1e-6)


def test_a_fixture_is_released_when_asked_and_a_band_lowers_the_robot_and_slackens() -> None:
    fixture, band = Support("fixture", np.inf), Support("band", np.inf)
    released = []
    for turn in range(4000):
        if turn == 10:
            fixture.let_go()
            band.let_go()
        for support in (fixture, band):
            support.advance(0.002, stiff=False)
        released.append(fixture.just_released)
        if turn in (5, 1000):
            assert band.force(np.zeros(3), np.zeros(3))[2] > 200.0
            assert band.waits == fixture.rigid == (turn == 5)
    assert np.flatnonzero(released).tolist() == [10]
    assert not band.force(np.zeros(3), np.zeros(3)).any()


def test_a_policy_that_observes_the_object_carries_it_by_the_pose_that_the_robot_sends(sighted: Path) -> None:
    controller = Controller.load(sighted)
    machine, standing = Machine(controller, "lift", SafetyLimits(ramp=0.1)), Ranges(controller.contract).standing
    fixed = {"impulse_scale": 0.0, "push_scale": 0.0, "partner_share": 0.0, "object_mass": 4.0}
    posture = controller.settled_posture(standing)[0]
    simulation = exported_world(sighted).recipe.simulation
    twin = Twin(controller.robot, simulation, 50.0, "lift", 0, posture, Support("fixture", 0.2), fixed)
    poses = Udp(Ranges(controller.contract), 0)
    requests = {10: State.DAMPING, 20: State.STAND, 100: State.RUN}
    with object_tracking(poses.port) as track:
        for turn in range(1500):
            now = turn * PERIOD
            pose = poses.wanted(now, None)
            wanted = OperatorRequest(standing, now, requests.get(turn), pose.seen, pose.seen_at)
            twin.command(machine.turn(CycleInputs(now, (twin.state,), wanted)))
            twin.step()
            track(twin)
    poses.close()
    assert machine.state is State.RUN
    assert not twin.fallen
    assert twin.simulation.state.grasped.all()
    truth = twin.simulation.state
    position = truth.base_rotation[0].T @ (truth.object_position[0] - truth.base_position[0])
    np.testing.assert_allclose(pose.seen["object_position"][0], position, atol=0.05)


def test_a_pose_cannot_be_sent_to_port_0() -> None:
    with pytest.raises(UsageError, match="udp:0"), object_tracking(0):
        pass


class View:
    """A page whose visitor releases the robot and pulls at it."""

    def __init__(self) -> None:
        self.answers: list[tuple[float, str, bool]] = []

    def asked(self) -> Asked:
        return True, {"robot": np.array([0.0, 30.0, 0.0]), "object": np.ones(3)}

    def answer(self, seconds: float, beside: Sequence[Force], status: str, supported: bool) -> None:
        assert [force.kind for force in beside] == ["band"]
        self.answers.append((seconds, status, supported))


def test_a_visitor_of_the_page_releases_the_robot_and_pulls_at_it(twin: Twin) -> None:
    view: Any = View()
    for _ in range(10):
        twin.step()
    _show(twin, view)
    assert twin.simulation.planned_push[0].tolist() == [0.0, 30.0, 0.0]
    assert not twin.simulation.planned_impulse.any()
    ((seconds, status, supported),) = view.answers
    assert (seconds, supported) == (0.02, False)
    assert "upright" in status
