"""The paper's tracking errors of a logged run, as far as onboard sensors allow.

Height and velocity come from the legs' kinematics and assume that the lower sole stands still. The velocity is the
pelvis's, not v_sys, since the object is not measured.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.errors import UsageError
from iowbc.onboard.log import read_cycles, read_states
from iowbc.onboard.machine import FREQUENCY, State
from iowbc.onboard.sensors import Sensors
from iowbc.robot import rotations
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class LoggedRun:
    """Motion of a robot in state run, at the rate of the policy; first axis: T control steps."""

    time: Array
    """Time since the log's beginning, (T,) [s]."""
    command: Array
    """Requested command C, (T, 11)."""
    height: Array
    """Height of the pelvis above the lower sole, (T,) [m]."""
    pitch: Array
    """Lean of the torso, (T,) [rad]."""
    heading: Array
    """(T,) [rad]."""
    velocity: Array
    """Velocity of the pelvis in the heading frame, averaged over a gait period, (T, 2) [m/s]."""

    @property
    def wanted_heading(self) -> Array:
        """Heading at the start, and after each pause, plus the integrated yaw rate commanded, (T,) [rad]."""
        period = np.diff(self.time, prepend=self.time[0])
        paused = period > PAUSE
        turned = np.cumsum(self.command[:, YAW_RATE] * np.where(paused, 0.0, period))
        begin = np.maximum.accumulate(np.where(paused, np.arange(len(period)), 0))
        wanted: Array = self.heading[begin] + turned - turned[begin]
        return wanted

    def deviations(self) -> dict[str, Array]:
        """Deviation from the requested command, by the error's name, (T,) each."""
        return {
            "E_v": np.linalg.norm(self.velocity - self.command[:, :2], axis=1),
            "E_ψ": np.abs(self.heading - self.wanted_heading),
            "E_α": np.abs(self.pitch - self.command[:, PITCH]),
            "E_h": np.abs(self.height - self.command[:, HEIGHT]),
        }


PAUSE = 0.5
"""Time between two rows after which another run begins [s]."""
HALF_CYCLE = 0.5 / FREQUENCY
UNITS = {"E_v": "m/s", "E_ψ": "rad", "E_α": "rad", "E_h": "m"}


def read_run(path: Path, robot: Robot, control_frequency: float, gait_frequency: float) -> LoggedRun:
    """Part of a log in state run. Raises UsageError without one, Damaged for another file."""
    sensors, every = Sensors(len(robot.joints)), round(FREQUENCY / control_frequency)
    rows, soles, begin = [], [], None
    events = list(read_states(path))
    times = [time for time, _ in events]
    for number, (given, _) in enumerate(read_cycles(path)):
        begin = given.now if begin is None else begin
        sensors.take(given.states, given.now)
        event = np.searchsorted(times, given.now + HALF_CYCLE) - 1
        if number % every or event < 0 or events[event][1] is not State.RUN or sensors.posture is None:
            continue
        now, wanted = sensors.posture, given.wanted
        angles = dict(zip(robot.joints, now.position, strict=True))
        x, y, z = now.gravity
        roll, pitch = np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z))
        upright = rotations.matrix(rotations.from_euler(roll, pitch, np.zeros(())))
        feet = np.stack([upright @ robot.tree.forward(angles, robot.base, sole)[0] for sole in robot.soles])
        torso = robot.tree.pose(angles, robot.base, robot.torso)[1]
        lean = float(rotations.lean_of(upright @ torso))
        rows.append([given.now - begin, lean, sensors.heading, *wanted.command])
        soles.append(feet)
    if len(rows) < 2:
        raise UsageError(f"{path}: the robot never ran")
    table, feet = np.array(rows), np.array(soles)
    return LoggedRun(
        time=table[:, 0],
        command=table[:, 3:],
        height=-feet[..., 2].min(axis=1),
        pitch=table[:, 1],
        heading=table[:, 2],
        velocity=_averaged(_velocity(feet, table[:, 0], table[:, 2]), round(control_frequency / gait_frequency)),
    )


def _velocity(feet: Array, time: Array, heading: Array) -> Array:
    """Planar velocity of the pelvis, (T, 2) [m/s]; `feet` (T, 2, 3): soles from the base; all in the heading frame."""
    period = np.maximum(np.diff(time), 1e-6)
    lower = feet[1:, :, 2].argmin(axis=1)
    place = np.arange(len(lower))
    moved = (feet[1:] - feet[:-1])[place, lower, :2] / period[:, None]
    turning = (np.diff(heading) / period)[:, None]
    arm = feet[1:][place, lower, :2]
    velocity = -moved - turning * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return np.concatenate([velocity[:1], velocity])


def _averaged(values: Array, window: int) -> Array:
    """Centred moving average over a window of rows."""
    kernel = np.ones(min(window, len(values)))
    weight = np.convolve(np.ones(len(values)), kernel, "same")
    return np.stack([np.convolve(column, kernel, "same") / weight for column in values.T], axis=1)
