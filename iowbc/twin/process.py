"""Process of a simulated robot: states and object poses out, commands in, in real time or in lock step with those."""

import json
import socket
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from iowbc.control.sensors import quantities
from iowbc.errors import UsageError
from iowbc.onboard import messages
from iowbc.onboard.process import PATIENCE, PERIOD
from iowbc.twin.robot import Twin

if TYPE_CHECKING:
    from iowbc.onboard.dds import DdsBus

BATTERY_PERIODS = 250
"""Bus periods between two battery states."""
POSE_PERIODS = 5
"""Bus periods between two poses: 100 Hz, as motion capture."""


class ObjectTracking:
    """Simulated motion capture: sends the object's pose to a local port, for `iowbc robot --object-pose`."""

    def __init__(self, port: int) -> None:
        """Raises UsageError for port 0, which is valid only for a listener."""
        if port == 0:
            raise UsageError("--object-pose udp:0: nothing can be sent there; give the port of `iowbc robot`")
        self._address = ("127.0.0.1", port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(self, twin: Twin) -> None:
        """Sends the measured pose, with the recipe's noise and latency; call it after every period."""
        if twin.periods % POSE_PERIODS == 0:
            measured = twin.simulation.measured
            seen = {name: getattr(measured, name)[0].tolist() for name in quantities(of_object=True)}
            self._socket.sendto(json.dumps({"seen": seen}).encode(), self._address)

    def close(self) -> None:
        self._socket.close()


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
