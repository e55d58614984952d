"""State machine of a robot: maps messages from the bus to the next low-level command.

ZeroTorque → Damping → Stand → Run → Damping. It uses no clock, bus or files, so that replaying the logged inputs
reproduces its commands bit for bit.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import COMMAND, HEIGHT
from iowbc.deploy.controller import Controller
from iowbc.onboard import checks, messages
from iowbc.onboard.checks import LIMITS, SafetyLimits
from iowbc.onboard.messages import Record
from iowbc.onboard.ranges import Ranges
from iowbc.onboard.sensors import Sensors

FREQUENCY = 500.0
"""Rate at which commands are sent [Hz], that of the robot's states."""


class State(StrEnum):
    """States of a robot."""

    ZERO_TORQUE = "zero-torque"
    DAMPING = "damping"
    """Velocity damping only."""
    STAND = "stand"
    """Gains and posture ramp to those of standing and stay there."""
    RUN = "run"
    """The policy acts."""


BEFORE = {State.STAND: State.DAMPING, State.RUN: State.STAND}
"""Required previous state; states that are not listed can follow any state."""
MOVING = tuple(BEFORE)
"""States that change to damping on a fault."""


@dataclass(frozen=True)
class OperatorRequest:
    """Command and request of an operator."""

    command: Array
    """C, (11,)."""
    at: float
    """Time of the command [s]."""
    request: State | None = None
    """State to enter."""
    seen: Mapping[str, Array] = field(default_factory=lambda: MappingProxyType({}))
    """Measurements of the object by name, one row each; empty for a controller that observes none."""
    seen_at: float = -np.inf
    """Time of the object's measurement [s]."""


@dataclass(frozen=True)
class CycleInputs:
    """Inputs of a cycle of the loop."""

    now: float
    """Monotonic clock [s]."""
    states: tuple[Record, ...]
    """States that arrived since the last cycle, oldest first."""
    wanted: OperatorRequest
    others: int = 0
    """Number of low-level commands from other programs since the last cycle."""
    charge: float | None = None
    """Battery charge, if its state arrived since the last cycle [%]."""


class Machine:
    """State machine, watchdogs and controller of a robot."""

    def __init__(self, controller: Controller, scene: str, limits: SafetyLimits = LIMITS) -> None:
        """`controller`: of one robot; `scene`: base grasp and expected load. Raises ValueError for an unknown scene."""
        self.controller, self.limits, self._scene = controller, limits, scene
        controller.reset(scene=scene)
        self._contract = contract = controller.contract
        self._joints = len(contract.joints)
        self.sensors, self._ranges = Sensors(self._joints), Ranges(contract)
        self.state = State.ZERO_TORQUE
        self.events: list[str] = []
        """Events of the last cycle with their reasons: states entered, requests refused, and warnings."""
        self._kp, self._kd = np.array(contract.kp), np.array(contract.kd)
        self._period = 1.0 / contract.control_frequency
        self._due: float | None = None
        """Time of the next policy step [s]; None before the first one."""
        self._standing = np.zeros(len(COMMAND))
        """Command of the standing posture, without velocities."""
        self._last = -np.inf
        self._entered = 0.0
        self._foreign = -np.inf
        """Time of the last command of another program [s]."""
        self._charge: float | None = None
        self._charged = -np.inf
        """Time of the newest battery message [s]."""
        self._warned: set[str] = set()
        self._from = self._goal = self._target = np.array(contract.default_position)

    def turn(self, given: CycleInputs) -> Record:
        """Low-level command of this cycle."""
        self.events = []
        given = replace(given, wanted=replace(given.wanted, command=self._ranges.clipped(given.wanted.command)))
        self.sensors.take(given.states, given.now)
        if given.charge is not None:
            self._charge, self._charged = given.charge, given.now
        self._foreign = given.now if given.others else self._foreign
        wanted = given.wanted.request
        if self.state in MOVING and (reason := self._fault(given)) is not None:
            self._enter(State.DAMPING, given, reason)
        elif wanted is not None and wanted is not self.state:
            if (refusal := self._refusal(wanted, given)) is None:
                self._enter(wanted, given, "requested")
            else:
                self.events.append(f"{wanted} refused: {refusal}")
        if self.state in MOVING:  # low or silent battery, or warm motor: warn once after each Stand
            found = self._exhausted(self.limits.battery, self.limits.temperature)
            if self._charge is not None and (age := given.now - self._charged) > self.limits.battery_age:
                found["silence"] = f"no battery message for {age:.0f} s, the last said {self._charge:.0f} %"
            self.events += [f"warning: {text}" for name, text in found.items() if name not in self._warned]
            self._warned |= found.keys()
        self._last = given.now
        if self.state is State.RUN:
            self._act(given)
        return self._command(given.now)

    def damp(self) -> Record:
        """Low-level command that damps the robot, whatever its state was."""
        self.state = State.DAMPING
        return self._command(self._last)

    def _fault(self, given: CycleInputs) -> str | None:
        """Reason to damp, or None."""
        limits = self.limits
        if given.others:
            return f"second publisher: {given.others} low-level commands of another program"
        if (gap := given.now - self._last) > limits.overrun:
            return f"loop overrun: {1e3 * gap:.1f} ms since the last turn"
        if (reason := self._stale_input(given, pose=self.state is State.RUN)) is not None:
            return reason
        return self._motion_fault(given.now)

    def _motion_fault(self, now: float) -> str | None:
        """Reason against moving, of a robot that has sent states."""
        limits, posture = self.limits, self.sensors.posture
        assert posture is not None
        return (
            checks.stale(self.sensors, now, limits)
            or checks.beyond(posture, self._contract, limits)
            or next(iter(self._exhausted(limits.battery_empty, limits.temperature_hot).values()), None)
        )

    def _exhausted(self, least: float, most: float) -> dict[str, str]:
        """Messages about a battery below `least` [%] and a motor above `most` [°C]."""
        assert self.sensors.posture is not None
        found, charge, temperature = {}, self._charge, self.sensors.posture.temperature
        if charge is not None and charge < least:
            found["battery"] = f"battery at {charge:.0f} %, less than {least:g}"
        if (hottest := temperature.max()) > most:
            joint = self._contract.joints[int(np.argmax(temperature))]
            found["temperature"] = f"temperature: {joint} at {hottest:.0f} °C, above {most:g}"
        return found

    def _refusal(self, wanted: State, given: CycleInputs) -> str | None:
        limits, now = self.limits, self.sensors.posture
        if wanted not in BEFORE:
            return None
        if self.state is not BEFORE[wanted]:
            return f"it follows {BEFORE[wanted]}, and the robot is in {self.state}"
        if now is None:
            return "no state has arrived"
        if given.now - self._foreign < limits.command_age:
            return "second publisher: another program sends low-level commands"
        if (reason := self._motion_fault(given.now)) is not None:
            return reason
        if now.tilt > limits.standing_tilt:
            return f"the pelvis leans by {now.tilt:.2f} rad, more than {limits.standing_tilt:g}"
        if wanted is State.STAND and (speed := np.abs(now.velocity).max()) > limits.standing_speed:
            return f"a joint moves at {speed:.1f} rad/s, more than {limits.standing_speed:g}"
        if wanted is State.RUN:
            if given.now - self._entered < limits.ramp:
                return "the standing posture is not reached yet"
            error = np.abs(now.position - self._goal)
            if error[worst := int(np.argmax(error))] > limits.standing_error:
                return f"{self._contract.joints[worst]} is {error[worst]:.2f} rad from the standing posture"
        return self._stale_input(given, pose=wanted is State.RUN)

    def _stale_input(self, given: CycleInputs, *, pose: bool) -> str | None:
        """Reason if the newest command is stale, or with `pose` a pose that the policy observes is stale or missing."""
        wanted, limits = given.wanted, self.limits
        if (age := given.now - wanted.at) > limits.command_age:
            return f"stale command: nothing new for {age:.2f} s"
        if not np.isfinite(wanted.command).all():
            return "the command is not finite"
        if not pose:
            return None
        if missing := self._ranges.seen.keys() - wanted.seen.keys():
            return f"no object pose: {', '.join(sorted(missing))}; this policy observes the object"
        if self._ranges.seen and (age := given.now - wanted.seen_at) > limits.object_age:
            return f"stale object pose: nothing new for {age:.2f} s"
        return None

    def _enter(self, state: State, given: CycleInputs, why: str) -> None:
        self.state, self._entered, self._due = state, given.now, None
        self.events.append(f"{state}: {why}")
        if state is State.STAND:
            self._warned.clear()
            assert self.sensors.posture is not None
            self._from = self.sensors.posture.position
            self._standing = given.wanted.command.copy()
            self._standing[:HEIGHT] = 0.0
            self._goal = self.controller.settled_posture(self._standing)[0]
        elif state is State.RUN:
            self.controller.reset(scene=self._scene)

    def _act(self, given: CycleInputs) -> None:
        """A policy step when one is due; if it is late or its targets are held, the robot damps. The first step has the
        command of the standing posture, from which later ones approach the operator's."""
        first, now = self._due is None, given.now
        due = now if self._due is None else self._due
        if now < due - 0.5 / FREQUENCY:
            return
        if (late := now - due) > self.limits.overrun:
            self._enter(State.DAMPING, given, f"policy step overrun: {1e3 * late:.1f} ms late")
            return
        self._due = due + self._period
        measured = replace(self.sensors.measured, **given.wanted.seen)
        command = self._standing if first else given.wanted.command
        targets = self.controller.step(measured, command, measured_at=self.sensors.at)
        if targets.held[0]:
            self._enter(State.DAMPING, given, targets.reasons[0])
            return
        self._target = targets.position[0]

    def _command(self, now: float) -> Record:
        command = messages.empty(messages.LOW_COMMAND)
        motors = command["motor_cmd"][: self._joints]
        motors["mode"] = 1
        if self.state is State.DAMPING:
            motors["kd"] = self.limits.damping * self._kd
        elif self.state is State.STAND:
            part = min(1.0, (now - self._entered) / self.limits.ramp)
            motors["q"] = self._from + part * (self._goal - self._from)
            motors["kp"], motors["kd"] = part * self._kp, self._kd
        elif self.state is State.RUN:
            motors["q"], motors["kp"], motors["kd"] = self._target, self._kp, self._kd
        if self.sensors.state is not None:
            command["mode_machine"] = self.sensors.state["mode_machine"]
        command["crc"] = messages.checksum(command)
        return command
