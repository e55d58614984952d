"""Faults between a robot and the program that drives it: `python tests/onboard/faults.py EXPORT` prints their table.

Twin and state machine take turns of 2 ms in one process, so that no figure depends on this machine; what carries their
messages drops, delays, repeats, reorders and spoils them from a certain time on.
"""

import argparse
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.evaluation.exported import exported_world
from iowbc.onboard.machine import CycleInputs, Machine, OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.process import PERIOD
from iowbc.onboard.ranges import Ranges
from iowbc.twin.robot import Twin
from iowbc.twin.support import Support

REQUESTS = {0.1: State.DAMPING, 0.2: State.STAND, 3.3: State.RUN}
"""When which state is asked for [s]."""
RELEASE = 0.5
"""The fixture opens that long after the gains are full, just after Run begins [s]."""
ONSET, END = 6.0, 10.0
"""When a fault begins, and when the trial ends [s]."""

Channel = Callable[[list[Record], float], list[Record]]
"""From messages sent, and the time since the fault began [s], to messages that arrive."""


def passed(messages: list[Record], since: float) -> list[Record]:
    """A channel without a fault."""
    return messages


def dropping(share: float) -> Channel:
    """Loses a share of the messages."""
    rng = np.random.default_rng(0)
    return lambda messages, since: [each for each in messages if rng.random() >= share]


def delaying(periods: int) -> Channel:
    """Delivers every message some periods late."""
    line: deque[list[Record]] = deque([[] for _ in range(periods)])

    def through(messages: list[Record], since: float) -> list[Record]:
        line.append(messages)
        return line.popleft()

    return through


def repeating(messages: list[Record], since: float) -> list[Record]:
    """Delivers every message twice."""
    return [each for each in messages for _ in range(2)]


def reordering() -> Channel:
    """Delivers messages in pairs, the later one first."""
    kept: list[Record] = []

    def through(messages: list[Record], since: float) -> list[Record]:
        kept.extend(messages)
        if len(kept) < 2:
            return []
        delivered = kept[::-1]
        kept.clear()
        return delivered

    return through


def spoiling(change: Callable[[Record], None]) -> Channel:
    """Changes every message."""

    def through(messages: list[Record], since: float) -> list[Record]:
        changed = [each.copy() for each in messages]
        for each in changed:
            change(each)
        return changed

    return through


def freezing(*parts: str) -> Channel:
    """Delivers some parts of the first message with the rest of those that follow."""
    first: list[Record] = []

    def through(messages: list[Record], since: float) -> list[Record]:
        first.extend(messages[: 1 - len(first)])
        frozen = [each.copy() for each in messages]
        for each in frozen:
            for part in parts:
                each[part] = first[0][part]
        return frozen

    return through


def joint(name: str, value: float) -> Channel:
    """Replaces a value of the fifth motor."""

    def change(state: Record) -> None:
        state["motor_state"][name][4] = value

    return spoiling(change)


@dataclass(frozen=True)
class Fault:
    """What goes wrong, and what has to come of it."""

    damped: str | None
    """Beginning of the reason for which the robot is damped; None where it has to go on."""
    within: float = 0.02
    """Time to damping [s]."""
    states: Callable[[], Channel] = lambda: passed
    """What happens to states on their way."""
    commands: Callable[[], Channel] = lambda: passed
    """What happens to commands on their way."""
    others: int = 0
    """Commands of another program in each turn."""
    hang: float = 0.0
    """How long the loop hangs once [s]."""
    charge: float | None = None
    """Of the battery, where its state arrives [%]."""
    silent: bool = False
    """The operator falls silent."""


FAULTS = {
    "30 % of states lost": Fault(None, states=lambda: dropping(0.3)),
    "all states lost, or publisher stopped": Fault("stale state", states=lambda: dropping(1.0)),
    "states 6 ms late": Fault(None, states=lambda: delaying(3)),
    "states 30 ms late": Fault("stale state", states=lambda: delaying(15)),
    "states sent twice": Fault(None, states=lambda: repeating),
    "states in wrong order": Fault(None, states=reordering),
    "sensors frozen": Fault("stale state", states=lambda: freezing("imu_state", "motor_state")),
    "inertial unit frozen": Fault("frozen imu_state", within=0.06, states=lambda: freezing("imu_state")),
    "motors frozen": Fault("frozen motor_state", within=0.06, states=lambda: freezing("motor_state")),
    "joint position NaN": Fault("a measurement is not finite", states=lambda: joint("q", np.nan)),
    "joint position beyond its limit": Fault("position limit", states=lambda: joint("q", 1.0)),
    "joint speed beyond its limit": Fault("velocity limit", states=lambda: joint("dq", 80.0)),
    "torque beyond its limit": Fault("torque limit", states=lambda: joint("tau_est", 90.0)),
    "battery at 9 %": Fault("battery", charge=9.0),
    "motor at 101 °C": Fault("temperature", states=lambda: joint("temperature", 101)),
    "30 % of commands lost": Fault(None, commands=lambda: dropping(0.3)),
    "all commands lost": Fault("tilt", within=END, commands=lambda: dropping(1.0)),
    "second publisher": Fault("second publisher", others=1),
    "loop hangs for 15 ms": Fault("loop overrun", hang=0.015),
    "operator silent": Fault("stale command", within=0.52, silent=True),
}


@dataclass(frozen=True)
class Outcome:
    """How a trial with a fault ended."""

    state: State
    reason: str
    """Why the robot was damped; "" where it was not."""
    time: float
    """From the fault to damping [s]; NaN where there was none."""
    fallen: bool


def play(folder: Path, fault: Fault) -> Outcome:
    """A standing robot that meets a fault."""
    world, controller = exported_world(folder), Controller.load(folder)
    machine, standing = Machine(controller, "free"), Ranges(controller.contract).standing
    posture = controller.settled_posture(standing)[0]
    fixed = {"impulse_scale": 0.0, "push_scale": 0.0}
    support = Support("fixture", RELEASE)
    twin = Twin(controller.robot, world.recipe.simulation, 50.0, "free", 0, posture, support, fixed)
    states, commands, requests = fault.states(), fault.commands(), dict(REQUESTS)
    now, at, reason, time = 0.0, 0.0, "", np.nan
    for turn in range(round(END / PERIOD)):
        now += PERIOD
        broken, since = turn >= round(ONSET / PERIOD), now - ONSET
        if turn == round(ONSET / PERIOD):
            now += fault.hang
        arrived = states([twin.state], since) if broken else [twin.state]
        request = next((requests.pop(when) for when in list(requests) if now >= when), None)
        at = at if broken and fault.silent else now
        wanted = OperatorRequest(standing, at, request)
        charge = fault.charge if broken else None
        command = machine.turn(CycleInputs(now, tuple(arrived), wanted, fault.others * broken, charge))
        if broken and machine.state is State.DAMPING and not reason:
            reason, time = machine.events[-1].partition(": ")[2], turn * PERIOD - ONSET
        for each in commands([command], since) if broken else [command]:
            twin.command(each)
        twin.step()
    return Outcome(machine.state, reason, time, twin.fallen)


def main() -> None:
    """Print the table of faults."""
    parser = argparse.ArgumentParser()
    parser.add_argument("export")
    folder = exported_folder(parser.parse_args().export)
    print("| fault | program's state | reason | time until damping is sent | robot |\n|---|---|---|---:|---|")
    for name, fault in FAULTS.items():
        end = play(folder, fault)
        time = "" if np.isnan(end.time) else f"{1e3 * end.time:.0f} ms"
        lying = "fell" if end.fallen else "stands"
        print(f"| {name} | {end.state} | {end.reason} | {time} | {lying} |", flush=True)


if __name__ == "__main__":
    main()
