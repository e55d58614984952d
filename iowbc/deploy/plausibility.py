"""Plausibility of measurements and commands (units, norms, ranges, age) and of joint targets (finite, without jumps),
checked for each robot."""

import logging
from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType

import numpy as np
from pydantic import Field

from iowbc.arrays import Array, Mask
from iowbc.control.command import COMMAND
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import Contract
from iowbc.recipe.section import Section

LOG = logging.getLogger(__name__)
JUMP = 2.0
"""Largest change of a target, as a multiple of the joint's velocity limit times the elapsed time. Targets of a PD loop
also set torques: the largest factor in 96 trials was 1.3, and 1 was exceeded three times in 79 minutes of walking."""
UNIT_LENGTH = ("projected_gravity", "object_quaternion")
"""Measured quantities of length 1."""


class Limits(Section):
    """Plausible measurements and commands, wide enough for a fall: they detect wrong units and broken sensors."""

    norm: tuple[float, float] = (0.5, 1.5)
    """Norm of the direction of gravity and of quaternions: 1, but for noise; 9.81 is an acceleration."""
    joint_margin: float = Field(default=0.5, ge=0.0)
    """Tolerance beyond the joint limits [rad], for encoder bias and elastic stops; values in degrees exceed it."""
    joint_speed: float = Field(default=3.0, gt=0.0)
    """Highest joint velocity, as a multiple of the joint's limit: falls stay below, degrees per second do not."""
    turning: float = Field(default=35.0, gt=0.0)
    """Highest angular velocity of base and object [rad/s]: 2000 degrees per second, where gyroscopes saturate."""
    heading: float = Field(default=1e5, gt=0.0)
    """Largest heading [rad]: float32 resolves it to 0.01 rad."""
    distance: float = Field(default=50.0, gt=0.0)
    """Largest distance of the object along an axis [m]: a reach in millimetres is more."""
    speed: float = Field(default=20.0, gt=0.0)
    """Highest velocity of the object along an axis [m/s]."""
    command: float = Field(default=10.0, gt=0.0)
    """Largest entry of a command [m/s, rad/s, m, rad]: more than any robot can do; degrees are more."""
    age: float = Field(default=0.1, gt=0.0)
    """Longest time without a new measurement [s]: five steps at 50 Hz; a robot out of balance falls in 0.5."""


WIDE = Limits()


class Plausibility:
    """Checks the measurements and commands of n robots; its only state is the age of the measurements."""

    def __init__(self, contract: Contract, limits: Limits, robots: int) -> None:
        high: dict[str, Array | float] = {
            "command": limits.command,
            "projected_gravity": limits.norm[1],
            "base_angular_velocity": limits.turning,
            "heading": limits.heading,
            "joint_position": np.array(contract.upper) + limits.joint_margin,
            "joint_velocity": limits.joint_speed * np.array(contract.velocity_limit),
            "object_position": limits.distance,
            "object_quaternion": limits.norm[1],
            "object_linear_velocity": limits.speed,
            "object_angular_velocity": limits.turning,
        }
        low = {name: -bound for name, bound in high.items()}
        low["joint_position"] = np.array(contract.lower) - limits.joint_margin
        sizes = {port.name: port.shape[0] for port in contract.inputs}
        entries = {"command": COMMAND, "joint_position": contract.joints, "joint_velocity": contract.joints}
        self.names = ("command", *(field.name for field in fields(Measured) if field.name in sizes))
        """Names of the checked values, in order."""
        self._unit_length = [name for name in UNIT_LENGTH if name in sizes]
        norms = len(self._unit_length)
        self._low, self._high = (
            np.concatenate([*(np.full(sizes[name], bounds[name]) for name in self.names), np.full(norms, norm)])
            for bounds, norm in zip((low, high), limits.norm, strict=True)
        )
        self._columns = [
            f"{name}[{entry}]" for name in self.names for entry in entries.get(name, map(str, range(sizes[name])))
        ] + [f"the norm of {name}" for name in self._unit_length]
        self._period, self._longest = 1.0 / contract.control_frequency, limits.age
        self._last: Array = np.zeros((robots, 0))
        self._repeated: Array = np.zeros(robots, np.int64)

    def refusals(self, given: dict[str, Array], measured_at: Array | None) -> dict[int, str]:
        """Reason by robot, for robots with implausible or old values. given: the values of `names`, (n, size) each.
        measured_at: time stamps of the measurements, (n,) [s], of any clock; without them equal values are one
        measurement, as sensors have noise."""
        values = [given[name] for name in self.names]
        rows = np.column_stack([*values, *(np.sqrt(np.vecdot(given[n], given[n])) for n in self._unit_length)])
        inside = (rows >= self._low) & (rows <= self._high)
        old = self._old(rows[:, values[0].shape[1] :] if measured_at is None else measured_at[:, None])
        refusals = {}
        for robot in np.flatnonzero(old | ~inside.all(axis=1)).tolist():
            column = int(np.argmin(inside[robot]))
            refusals[robot] = (
                f"the sensors have delivered nothing new for {self._repeated[robot] * self._period:.2f} s"
                if inside[robot].all()
                else f"{self._columns[column]} is {rows[robot, column]:.4g}, "
                f"which is not between {self._low[column]:.4g} and {self._high[column]:.4g}"
            )
        return refusals

    def _old(self, measurement: Array) -> Mask:
        """Robots whose measurement, (n, size), has not changed for too long, (n,)."""
        new: Mask = np.ones(len(measurement), np.bool_)
        if measurement.shape == self._last.shape:
            new = (np.isfinite(measurement) & (measurement != self._last)).any(axis=1)
        self._last = measurement
        self._repeated = np.where(new, 0, self._repeated + 1)
        return self._repeated * self._period > self._longest + 0.5 * self._period


class TargetGuard:
    """Holds the last good targets of robots whose new ones are not finite or jump. The allowed jump grows while targets
    are held, so that no robot is held forever."""

    def __init__(self, robots: int, velocity_limit: Array, period: float) -> None:
        """`velocity_limit` (joints,) [rad/s]; `period`: control period [s]."""
        self._reach = JUMP * velocity_limit * period
        self._last, self._steps = np.zeros((robots, len(velocity_limit))), np.zeros(robots, np.int64)
        self._reasons = ("",) * robots

    def passed(
        self, targets: Array, starts: Mask, position: Array, refusals: Mapping[int, str] = MappingProxyType({})
    ) -> tuple[Array, tuple[str, ...]]:
        """Targets to follow, (n, joints) [rad], and the reason for each robot to hold its last ones, "" if it does not.

        `starts` (n,): robots without last targets; if held, they hold the measured `position` (n, joints) instead.
        `refusals`: reasons of robots that hold theirs in any case.
        """
        last = np.where(starts[:, None], position, self._last)
        finite: Mask = np.asarray(np.isfinite(targets).all(axis=1))
        away = np.abs(np.where(finite[:, None], targets, last) - last) - self._reach * (1 + self._steps)[:, None]
        held: Mask = ~finite | (~starts & np.asarray((away > 0.0).any(axis=1)))
        held[list(refusals)] = True
        reasons = [""] * len(held)
        for robot in np.flatnonzero(held).tolist():
            joint = int(np.argmax(away[robot]))
            jump = f"the target of joint {joint} jumps by {np.abs(targets - last)[robot, joint]:.2f} rad"
            reasons[robot] = refusals.get(robot) or (jump if finite[robot] else "its targets are not finite")
            if not self._reasons[robot]:
                LOG.warning("robot %d: %s: the last good targets are held", robot, reasons[robot])
        self._reasons = tuple(reasons)
        self._steps = np.where(held, np.where(starts, 1, self._steps + 1), 0)
        self._last = np.where(held[:, None], last, targets)
        return self._last.copy(), self._reasons
