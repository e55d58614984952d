"""A MuJoCo robot on the bus, controlled only by low-level commands as the real one, in real time or in lock step.

The world is the recipe's, with its objects, sensors, delays and motor limits, at 1 kHz and with explicit PD control by
the gains of each command.
"""

import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import Measured, quantities
from iowbc.errors import UsageError
from iowbc.onboard import messages
from iowbc.onboard.checks import MODEL
from iowbc.onboard.machine import FREQUENCY
from iowbc.onboard.messages import Record
from iowbc.onboard.process import PATIENCE, PERIOD
from iowbc.recipe.simulation.randomization import LATENCIES
from iowbc.recipe.simulation.simulation import SimulationSettings
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY, Robot
from iowbc.sim.rendering.forces import Force
from iowbc.sim.simulation import Simulation
from iowbc.twin.support import HOOK, Support

if TYPE_CHECKING:
    from iowbc.onboard.dds import DdsBus

TIMESTEP = 0.001
"""Physics step [s], and period of the motors' PD control."""
SILENCE = 0.1
"""Time without commands after which the motors brake [s]; an assumption, since the drives' behaviour is not public."""
CHARGE, WARM = 90, 35
"""Battery [%] and motor temperature [°C] of a twin."""
LYING_HEIGHT, LYING_TILT = 0.35, 1.2
"""Pelvis height [m] below which, and tilt [rad] beyond which, the robot has fallen."""
BATTERY_PERIODS = 250
"""Bus periods between two battery states."""
POSE_PERIODS = 5
"""Bus periods between two poses: 100 Hz, as motion capture."""


def at_bus_rate(recipe: SimulationSettings, control_frequency: float) -> SimulationSettings:
    """The same world with the bus's period instead of the policy's; latencies keep their duration."""
    periods = round(FREQUENCY / control_frequency)
    drawn = recipe.randomization
    delays = {
        name: (kind := getattr(drawn, name)).model_copy(
            update={end: periods * getattr(kind, end) for end in ("low", "high", "nominal")}
        )
        for name in LATENCIES
    }
    randomization = drawn.model_copy(update={**delays, "longest_latency": periods * drawn.longest_latency})
    physics = recipe.physics.model_copy(update={"timestep": TIMESTEP, "pd": "explicit"})
    return recipe.model_copy(update={"physics": physics, "randomization": randomization})


class Twin:
    """A simulated robot: low-level commands in, low-level states out, one bus period at a time."""

    def __init__(
        self,
        robot: Robot,
        recipe: SimulationSettings,
        control_frequency: float,
        scene: str,
        seed: int,
        posture: Array,
        support: Support,
        fixed: dict[str, float],
    ) -> None:
        """`recipe`: of the world; `posture`: initial, (joints,) [rad]; `fixed`: quantities that are not sampled."""
        self.robot, self.support = robot, support
        held = {name: np.array([value]) for name, value in fixed.items()}
        self.simulation = Simulation(
            robot,
            at_bus_rate(recipe, control_frequency),
            envs=np.zeros(1, np.int64),
            seed=seed,
            scenes=(scene,),
            fixed=held,
            control_frequency=FREQUENCY,
        )
        world = self.simulation.worlds[0]
        self._gain, self._bias = world.batch.expand("actuator_gainprm"), world.batch.expand("actuator_biasprm")
        self._pull, self._centre, self._origin, self._frame = (
            world.batch.bind(name)[0, world.layout.torso] for name in ("xfrc_applied", "xipos", "xpos", "xmat")
        )
        self.simulation.reset(np.zeros(1, np.int64), posture[None])
        self._start = self._hook = self._hook_position()
        self.band = Force("band", self._hook, np.zeros(3))
        self._object = self.simulation.state.object_position[0].copy()
        self.periods = 0
        self._silent = 0
        self._command = messages.empty(messages.LOW_COMMAND)

    def command(self, message: Record) -> None:
        """Accepts a command; ignores one with a wrong checksum, as the robot does."""
        if messages.checksum(message) == message["crc"]:
            self._command, self._silent = message, 0

    def step(self) -> None:
        motors = self._command["motor_cmd"][: len(self.robot.joints)]
        enabled = motors["mode"] == 1
        kp, kd, tau, dq = (
            np.where(enabled, motors[name], 0.0).astype(np.float64) for name in ("kp", "kd", "tau", "dq")
        )
        if self._silent > SILENCE * FREQUENCY:
            tau, dq, kd = 0.0 * tau, 0.0 * dq, self.robot.kd if kp.any() else kd
            kp = 0.0 * kp
        self._drive(kp, kd, motors["q"], dq, tau)
        self.periods += 1
        self._silent += 1
        self.support.advance(1.0 / FREQUENCY, bool((kp >= 0.99 * self.robot.kp).all()))
        if self.support.rigid:
            self.simulation.pause()
            return
        if self.support.just_released:
            self.simulation.clock[:] = 0
        before, self._hook = self._hook, self._hook_position()
        force = self.support.force(self._hook - self._start, FREQUENCY * (self._hook - before))
        self.band = Force("band", self._hook, force)
        self._pull[:] = *force, *rotations.cross(self._hook - self._centre, force)
        self.simulation.step()

    def _hook_position(self) -> Array:
        return self._origin + self._frame.reshape(3, 3) @ HOOK

    def _drive(self, kp: Array, kd: Array, target: Array, speed: Array, torque: Array) -> None:
        """Sets gains, scaled by the sampled motor errors, targets and feed-forward torques; a non-finite target keeps
        its last value, a non-finite torque is 0."""
        drawn, simulation = self.simulation.drawn, self.simulation
        kp, kd = kp * drawn["kp_scale"][0], kd * drawn["kd_scale"][0]
        self._gain[0, :, 0], self._bias[0, :, 1], self._bias[0, :, 2] = kp, -kp, -kd
        self._bias[0, :, 0] = np.nan_to_num(torque + kd * speed, nan=0.0, posinf=0.0, neginf=0.0)
        simulation.target[0] = np.where(np.isfinite(target), target, simulation.target[0])

    @property
    def time(self) -> float:
        """Time since the simulation began [s]."""
        return self.periods / FREQUENCY

    @property
    def state(self) -> Record:
        return low_state(round(1e3 * self.time), self.simulation.measured, self.simulation.state.joint_torque[0])

    @property
    def battery(self) -> Record:
        message = messages.empty(messages.BATTERY_STATE)
        message["soc"] = CHARGE
        return message

    @property
    def fallen(self) -> bool:
        state = self.simulation.state
        low = state.base_position[0, 2] < LYING_HEIGHT
        return bool(low or state.base_rotation[0, 2, 2] < np.cos(LYING_TILT))

    @property
    def verdict(self) -> str:
        """Summary of robot and object."""
        state = self.simulation.state
        way = float(np.linalg.norm(state.base_position[0, :2]))
        parts = [f"{self.time:.1f} s", "fallen" if self.fallen else "upright", f"pelvis {way:.2f} m from its start"]
        if state.has_object[0]:
            moved = float(np.linalg.norm(state.object_position[0, :2] - self._object[:2]))
            hands = int(state.grasped[0].sum())
            parts.append(f"object {moved:.2f} m from its start, {hands} hands at it")
        return ", ".join(parts)


def low_state(tick: int, seen: Measured, torque: Array) -> Record:
    """State message of a row of measurements; `tick` [ms]; estimated torques (joints,) [N·m]. Gravity and heading are
    sent as an orientation, which drops noise in the norm of gravity."""
    message = messages.empty(messages.LOW_STATE)
    message["mode_machine"], message["tick"] = MODEL, tick
    motors, imu = message["motor_state"][: len(torque)], message["imu_state"]
    motors["mode"], motors["temperature"], motors["tau_est"] = 1, WARM, torque
    motors["q"], motors["dq"] = seen.joint_position[0], seen.joint_velocity[0]
    gravity, yaw = seen.projected_gravity[0], seen.heading[0, 0]
    roll = np.arctan2(-gravity[1], -gravity[2])
    pitch = np.arctan2(gravity[0], np.hypot(gravity[1], gravity[2]))
    imu["quaternion"], imu["rpy"] = rotations.from_euler(roll, pitch, yaw), (roll, pitch, yaw)
    imu["gyroscope"], imu["accelerometer"] = seen.base_angular_velocity[0], -GRAVITY * gravity
    message["crc"] = messages.checksum(message)
    return message


@contextmanager
def object_tracking(port: int) -> Iterator[Callable[[Twin], None]]:
    """Simulated motion capture, for `iowbc robot --object-pose`: a function that sends the measured pose of the object,
    with the recipe's noise and latency, to a local port; call it after every period. Raises UsageError for port 0,
    which is valid only for a listener."""
    if port == 0:
        raise UsageError("--object-pose udp:0: nothing can be sent there; give the port of `iowbc robot`")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

        def send(twin: Twin) -> None:
            if twin.periods % POSE_PERIODS == 0:
                measured = twin.simulation.measured
                seen = {name: getattr(measured, name)[0].tolist() for name in quantities(of_object=True)}
                sender.sendto(json.dumps({"seen": seen}).encode(), ("127.0.0.1", port))

        yield send


def serve(
    bus: "DdsBus", twin: Twin, going: Callable[[], bool], each: Callable[[Twin], None], *, lockstep: bool
) -> None:
    """Simulates the robot while `going`, and calls `each` after every period. In lock step, every state waits for its
    command, as long as commands come."""
    due, following = time.monotonic(), False
    while going():
        if twin.periods % BATTERY_PERIODS == 0:
            bus.publish(twin.battery)
        bus.publish(twin.state)
        bus.answer_mode_requests()
        if lockstep and following:
            following = bus.wait(messages.LOW_COMMAND, PATIENCE)
            due = time.monotonic()
        else:
            due = max(due + PERIOD, time.monotonic() - PATIENCE)
            time.sleep(max(0.0, due - time.monotonic()))
        commands = bus.take(messages.LOW_COMMAND)
        following = following or bool(commands)
        for command in commands:
            twin.command(command)
        twin.step()
        each(twin)
