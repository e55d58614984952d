"""Ranges of the commands that a controller accepts."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import COMMAND, HEIGHT, OFFSET, PITCH, nominal_command
from iowbc.control.sensors import quantities
from iowbc.deploy.contract import Contract


class Ranges:
    """Command ranges of training, and the command to stand."""

    def __init__(self, contract: Contract) -> None:
        known = contract.commands
        self.velocity = np.array([known.velocity_x, known.velocity_y, known.yaw_rate]).T
        self._low, self._high = np.full(len(COMMAND), -1.0), np.ones(len(COMMAND))
        self._low[:HEIGHT], self._high[:HEIGHT] = self.velocity
        for place, (low, high) in ((HEIGHT, known.height), (PITCH, known.deep_pitch)):
            self._low[place], self._high[place] = low, high
        self._high[OFFSET] = np.tile(np.add(known.common_offset, known.single_offset), 2)
        self._low[OFFSET] = -self._high[OFFSET]
        self.standing = nominal_command(known)
        ports, of_object = contract.inputs, quantities(of_object=True)
        self.seen = {port.name: port.shape[0] for port in ports if port.name in of_object}
        """Sizes of the object's measurements that the controller observes, by name."""

    def clipped(self, command: Array) -> Array:
        """The command within the ranges, (11,)."""
        return np.clip(command, self._low, self._high)
