"""Process of a simulated robot: states out, commands in, in real time or in lock step with the commands."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from iowbc.onboard import messages
from iowbc.onboard.process import PATIENCE, PERIOD
from iowbc.twin.robot import Twin

if TYPE_CHECKING:
    from iowbc.onboard.dds import DdsBus

BATTERY_PERIODS = 250
"""Bus periods between two battery states."""


def serve(
    bus: "DdsBus",
    twin: Twin,
    going: Callable[[], bool],
    *,
    lockstep: bool,
    each: Callable[[Twin], None] = lambda _: None,
    answer: Callable[[], None] = lambda: None,
) -> None:
    """Simulates the robot while `going`; calls `answer` in and `each` after every period.

    In lock step, every state waits for its command, as long as commands come.
    """
    due, following = time.monotonic(), False
    while going():
        if twin.periods % BATTERY_PERIODS == 0:
            bus.publish(twin.battery)
        bus.publish(twin.state)
        answer()
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
