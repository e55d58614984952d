"""Conversion of the bus's states to the controller's measurements; skips repeated and outdated states."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import Measured
from iowbc.onboard.messages import Record
from iowbc.robot import rotations

SILENCE = 1.0
"""Time without a new state after which the robot may have restarted [s]; a robot that moved is damped long before."""
LARGEST_DISORDER = 100
"""Difference of ticks beyond which an earlier state is of another robot, and not merely out of order [ms]."""
CLOCK_DRIFT = 2e-4
"""Clock drift between the robot and this machine that does not count as delay [s/s]."""


@dataclass(frozen=True)
class MeasuredState:
    """A robot's state in the order of its joints."""

    position: Array
    """(joints,) [rad]."""
    velocity: Array
    """(joints,) [rad/s]."""
    torque: Array
    """Torque as estimated by the motor drives, (joints,) [N·m]."""
    temperature: Array
    """Temperature of the warmer of each motor's two sensors, (joints,) [°C]."""
    gravity: Array
    """Direction of gravity, base frame, (3,)."""
    turning: Array
    """Angular velocity, base frame, (3,) [rad/s]."""
    yaw: float
    """Heading within ±π [rad]."""

    @property
    def tilt(self) -> float:
        """Angle between the base and the vertical [rad]."""
        return float(np.arccos(np.clip(-self.gravity[2], -1.0, 1.0)))


def posture(state: Record, joints: int) -> MeasuredState:
    """Measurements in a state; they may be non-finite."""
    motors, imu = state["motor_state"][:joints], state["imu_state"]
    quaternion = imu["quaternion"].astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        rotation = rotations.matrix(rotations.normalized(quaternion))
    return MeasuredState(
        position=motors["q"].astype(np.float64),
        velocity=motors["dq"].astype(np.float64),
        torque=motors["tau_est"].astype(np.float64),
        temperature=motors["temperature"].max(axis=1).astype(np.float64),
        gravity=-rotation[2],
        turning=imu["gyroscope"].astype(np.float64),
        yaw=float(np.arctan2(rotation[1, 0], rotation[0, 0])),
    )


class Sensors:
    """Newest state of a robot, its age, and its unwrapped heading."""

    def __init__(self, joints: int) -> None:
        self._joints = joints
        self.state: Record | None = None
        self.posture: MeasuredState | None = None
        self.heading = 0.0
        self._yaw: float | None = None
        """Last heading within ±π that was finite [rad]."""
        self.at = -np.inf
        """Arrival time of the newest state [s]."""
        self.changed = dict.fromkeys(("imu_state", "motor_state"), -np.inf)
        """Time of the last state in which each part has other values than in the one before [s]."""
        self.mixed = -np.inf
        """Time of the last state that another robot seems to have sent [s]."""
        self.late = 0.0
        """Its delay beyond the smallest one so far, by the robot's clock [s]."""
        self._least, self._least_at = np.inf, 0.0

    def take(self, states: tuple[Record, ...], now: float) -> None:
        """Processes the states that arrived, oldest first, at `now` [s]."""
        for state in states:
            if self.state is not None and int(self.state["tick"]) - int(state["tick"]) > LARGEST_DISORDER:
                self.mixed = now if now - self.at < SILENCE else self.mixed
            if self._repeated(state, now):
                continue
            if self.state is not None and state["tick"] < self.state["tick"]:
                self._least = np.inf
            for part in self.changed:
                if self.state is None or (self.state[part] != state[part]).any():
                    self.changed[part] = now
            found = posture(state, self._joints)
            if np.isfinite(found.yaw):
                last, self._yaw = self._yaw, found.yaw
                self.heading += found.yaw if last is None else float(rotations.wrapped(np.asarray(found.yaw - last)))
            self.state, self.posture, self.at = state, found, now
            offset = now - 1e-3 * float(state["tick"])
            self._least = min(self._least + CLOCK_DRIFT * (now - self._least_at), offset)
            self._least_at, self.late = now, offset - self._least

    def _repeated(self, state: Record, now: float) -> bool:
        """True for a state that is no newer than the last or has identical values, since sensors have noise. An earlier
        tick is accepted after `SILENCE`, because the robot may have restarted."""
        last = self.state
        if last is None:
            return False
        frozen = last["imu_state"] == state["imu_state"] and (last["motor_state"] == state["motor_state"]).all()
        return bool((state["tick"] <= last["tick"] and now - self.at < SILENCE) or frozen)

    @property
    def measured(self) -> Measured:
        assert self.posture is not None
        now = self.posture
        return Measured(
            projected_gravity=now.gravity[None],
            base_angular_velocity=now.turning[None],
            heading=np.full((1, 1), self.heading),
            joint_position=now.position[None],
            joint_velocity=now.velocity[None],
        )
