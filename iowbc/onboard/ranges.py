"""Ranges of the commands that a controller accepts."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import HEIGHT, OFFSET, PITCH, VELOCITY, nominal_command
from iowbc.control.gait import wants_to_move
from iowbc.control.sensors import quantities
from iowbc.deploy.contract import Contract


class Ranges:
    """Command ranges of training, and the command to stand."""

    def __init__(self, contract: Contract) -> None:
        self._known, self._gait = contract.commands, contract.references.gait
        known = contract.commands
        self.velocity = np.array([known.velocity_x, known.velocity_y, known.yaw_rate]).T
        self.standing = nominal_command(known)
        ports, of_object = contract.inputs, quantities(of_object=True)
        self.seen = {port.name: port.shape[0] for port in ports if port.name in of_object}
        """Sizes of the object's measurements that the controller observes, by name."""

    def clipped(self, command: Array) -> Array:
        """The command within the ranges, (11,); a walking robot bows less than a standing one."""
        known, found = self._known, command.copy()
        found[VELOCITY] = command[VELOCITY].clip(*self.velocity)
        found[HEIGHT] = command[HEIGHT].clip(*known.height)
        walking = wants_to_move(found[None], self._gait)[0]
        found[PITCH] = command[PITCH].clip(*(known.pitch if walking else known.deep_pitch))
        offset = np.tile(np.add(known.common_offset, known.single_offset), 2)
        found[OFFSET] = command[OFFSET].clip(-offset, offset)
        return found
