"""Process that drives a robot: checks, then a loop from states to commands, timed and logged."""

import contextlib
import ctypes
import gc
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from iowbc.onboard import messages
from iowbc.onboard.checks import BusSnapshot
from iowbc.onboard.log import Background, LogWriter
from iowbc.onboard.machine import FREQUENCY, CycleInputs, Machine, State
from iowbc.onboard.messages import Record
from iowbc.onboard.operators import Operator

if TYPE_CHECKING:
    from iowbc.onboard.dds import DdsBus

PERIOD = 1.0 / FREQUENCY
PATIENCE = 1.0
"""Timeout for the next state in lock step [s]."""
DISCOVERY = 10.0
"""Timeout for the first state [s]: participants discover each other within some seconds."""
POLLING = 0.1
"""Period of checks for a stop while no state has arrived [s]."""
FINAL_DAMPING = 0.5
"""Duration of damping at the end [s]."""
REALTIME_PRIORITY = 60
"""Above ordinary threads of the kernel's real-time class, below its own."""
KEPT_TIMES = 1 << 20
"""Number of latest cycles kept for the timing statistics: 35 minutes."""


class MonotonicClock:
    """Periodic cycles on this machine's monotonic clock; missed ones are skipped."""

    def __init__(self) -> None:
        self._due = time.monotonic()
        self.late = 0.0
        """Delay of the last cycle's start [s]."""

    def turn(self, bus: "DdsBus") -> tuple[float, tuple[Record, ...]]:
        """Waits for the next cycle; returns its time [s] and the states that have arrived."""
        self._due += PERIOD
        now = time.monotonic()
        if now < self._due:
            time.sleep(self._due - now)
            now = time.monotonic()
        self.late = now - self._due
        self._due += PERIOD * (self.late // PERIOD)
        return now, tuple(bus.take(messages.LOW_STATE))


class LockStep:
    """One cycle for each state of a simulated robot, which waits for the command: runs as fast as both can."""

    late = 0.0

    def __init__(self) -> None:
        self._now = self._begin = 0.0
        self._tick = 0

    def turn(self, bus: "DdsBus") -> tuple[float, tuple[Record, ...]]:
        arrived = bus.wait(messages.LOW_STATE, PATIENCE)
        states = tuple(bus.take(messages.LOW_STATE))
        if arrived and states:
            last, self._tick = self._tick, int(states[-1]["tick"])
            if self._tick < last:  # the robot has restarted, and time goes on
                self._begin = self._now
            self._now = self._begin + 1e-3 * self._tick
        else:  # the robot's time stands still while it waits
            self._begin += PATIENCE
            self._now += PATIENCE
        return self._now, states


Clock = MonotonicClock | LockStep


@dataclass(frozen=True)
class Times:
    """Timing of the loop."""

    late: np.ndarray
    """Delay of each cycle's start [s]."""
    busy: np.ndarray
    """Duration of each cycle [s]."""

    def __str__(self) -> str:
        if not len(self.late):
            return "no turn"
        parts = [
            f"{name} p50 {1e3 * np.median(values):.2f}, p99 {1e3 * np.quantile(values, 0.99):.2f}, "
            f"worst {1e3 * values.max():.2f} ms"
            for name, values in (("late", self.late), ("turn", self.busy))
        ]
        last = "the last " if len(self.late) == KEPT_TIMES else ""
        return "; ".join([f"{last}{len(self.late)} turns", *parts])


def listen(bus: "DdsBus", seconds: float, stopped: Callable[[], bool] = lambda: False) -> BusSnapshot:
    """Receives messages for some time [s] from the first state on, or until `stopped`."""
    states: list[Record] = []
    battery: Record | None = None
    others = 0
    begin = time.monotonic()
    while not bus.wait(messages.LOW_STATE, POLLING):
        if stopped() or time.monotonic() - begin > DISCOVERY:
            return BusSnapshot([], DISCOVERY, None, 0, None)
    begin = time.monotonic()
    while (spent := time.monotonic() - begin) < seconds and not stopped():
        bus.wait(messages.LOW_STATE, 0.01)
        states += bus.take(messages.LOW_STATE)
        others += len(bus.take(messages.LOW_COMMAND))
        battery = next(iter(bus.take(messages.BATTERY_STATE)[::-1]), battery)
    return BusSnapshot(states, spent, battery, others, None if stopped() else bus.high_level_mode(seconds))


def enable_realtime() -> str:
    """Locks memory and raises the priority where allowed; returns a summary."""
    libc = ctypes.CDLL(None, use_errno=True)
    locked = libc.mlockall(3) == 0  # MCL_CURRENT | MCL_FUTURE
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME_PRIORITY))
        raised = True
    except PermissionError:
        raised = False
    gc.collect()
    gc.freeze()
    return f"memory {'locked' if locked else 'not locked'}, priority {'raised' if raised else 'not raised'}"


def drive(
    bus: "DdsBus",
    machine: Machine,
    operator: Operator,
    clock: Clock,
    *,
    charge: float | None = None,
    seconds: float = float("inf"),
    log: LogWriter | None = None,
    tell: Callable[[str], None] = print,
    stopped: Callable[[], bool] = lambda: False,
) -> Times:
    """Drives the robot until `stopped` or for some time [s], and damps it at the end, also after an error. `charge`:
    battery charge during the checks [%]."""
    turns = 0
    begin: float | None = None
    leaving: float | None = None
    with contextlib.closing(Background("teller", tell, FINAL_DAMPING)) as teller, _damping_after_errors(bus, machine):
        kept = np.full((2, KEPT_TIMES), np.nan, np.float32)  # allocated in advance
        while True:
            now, states = clock.turn(bus)
            started = time.perf_counter()
            others = len(bus.take(messages.LOW_COMMAND))
            begin = now if begin is None else begin
            wanted = operator.wanted(now, states[-1] if states else machine.sensors.state)
            if leaving is None and (stopped() or now - begin >= seconds):
                leaving = now
            if leaving is not None:
                wanted = replace(wanted, request=State.DAMPING)
            batteries = bus.take(messages.BATTERY_STATE)
            charge = float(batteries[-1]["soc"]) if batteries else charge
            given, charge = CycleInputs(now, states, wanted, others, charge), None
            command = machine.turn(given)
            bus.publish(command)
            for event in machine.events:
                teller.put(f"{now - begin:8.3f} s  {event}")
                if log is not None:
                    log.add("event", now, text=event, state=machine.state)
            if log is not None and not log.turn(given, command):
                teller.put(f"{now - begin:8.3f} s  log: {log.failure}; nothing more is logged")
                log = None
            kept[:, turns % KEPT_TIMES] = clock.late, time.perf_counter() - started
            turns += 1
            if leaving is not None and now - leaving >= FINAL_DAMPING:
                break
        times = Times(*kept[:, :turns])
        if log is not None:
            log.add("timing", now, text=str(times))
        return times


@contextlib.contextmanager
def _damping_after_errors(bus: "DdsBus", machine: Machine) -> Iterator[None]:
    try:
        yield
    except BaseException:
        for _ in range(round(FINAL_DAMPING / PERIOD)):
            bus.publish(machine.damp())
            time.sleep(PERIOD)
        raise
