"""Simulated motion capture of the object, as JSON over UDP."""

import json
import socket

from iowbc.control.sensors import quantities
from iowbc.errors import UsageError
from iowbc.twin.robot import Twin

POSE_PERIODS = 5
"""Bus periods between two poses: 100 Hz, as motion capture."""


class ObjectTracking:
    """Sends the object's pose to a local port, for `iowbc robot --object-pose`."""

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
