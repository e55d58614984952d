"""Compliance: target velocity under a force on the hands, v_coll + F/b, and the force beyond it."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.task.reward import Yielding
from iowbc.task.rewards.terms import SLOW


def excess_force(hand_force: Array, command: Array, needed: Array) -> Array:
    """Horizontal force of the object on the hands beyond what the transport needs, (n, 2) [N], heading frame.
    hand_force: on both hands together, (n, 2 or 3) [N]; command: planar velocity, (n, 2) [m/s]; needed: resistance that
    the hands overcome along the command, (n,) [N]."""
    speed = np.sqrt(np.vecdot(command, command))
    return hand_force[:, :2] + command * (needed / np.maximum(speed, SLOW))[:, None]


class Admittance:
    """Admittance law of n environments."""

    def __init__(self, recipe: Yielding, holding: Mask) -> None:
        """`holding`: environments that begin with an object in the hands, (n,); the others push one, or have none."""
        self._recipe = recipe
        held, pushed = (np.inf if damping is None else damping for damping in (recipe.held, recipe.pushed))
        self._damping = np.where(holding, held, pushed)
        self.rigid = bool(np.isinf(self._damping).all())
        """True if no force changes any velocity."""
        self.idle = self.rigid and recipe.force == 0.0
        """True if forces change nothing at all."""

    def _beyond(self, force: Array) -> tuple[Array, Array]:
        """Sizes of forces (n, 2) beyond the margin, (n,) [N], and the forces of these sizes, (n, 2) [N]."""
        size = np.sqrt(np.vecdot(force, force))
        beyond = np.maximum(size - self._recipe.margin, 0.0)
        return beyond, force * (beyond / np.maximum(size, SLOW))[:, None]

    def velocity(self, command: Array, force: Array) -> Array:
        """v_coll + F/b, (n, 2) [m/s]; command and filtered excess force (n, 2), heading frame."""
        if self.rigid:
            return command
        change = self._beyond(force)[1] / self._damping[:, None]
        speed = np.sqrt(np.vecdot(change, change))
        change *= np.minimum(1.0, self._recipe.largest_speed / np.maximum(speed, SLOW))[:, None]
        return command + change

    def unyielded(self, command: Array, force: Array) -> Array:
        """Size of the excess force beyond the margin and b·|v_coll|, or beyond the margin where b is infinite, no more
        than the largest that counts, (n,) [N]."""
        if self._recipe.force == 0.0:
            return np.zeros(len(command))
        speed = np.sqrt(np.vecdot(command, command))
        yielding = np.where(np.isinf(self._damping), 0.0, self._damping) * speed
        most = self._recipe.largest_force
        return (self._beyond(force)[0] - yielding).clip(0.0, most)
