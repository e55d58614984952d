"""What the palms of a compliant grasp resist beside their connection: turning about the line between them."""

from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.simulation.scene import Grasp, Object
from iowbc.sim.model_index import Layout
from iowbc.sim.shapes import measured

TINY = 1e-9


class Grip:
    """Elastic, damped and slipping torsion between hands and object in n simulations, held over a control period.

    The angle is the integral of the rate at which the object turns against the hands, cut where the palms slip.
    """

    def __init__(self, batch: Any, layout: Layout, thing: Object, grasp: Grasp, period: float) -> None:
        self._layout, self._grasp, self._period = layout, grasp, period
        self._sites, self._spatial = batch.bind("site_xpos"), batch.bind("cvel")
        self._about = measured(thing).about_axes[1] + grasp.height**2
        count = len(self._sites)
        self.angle, self.rate = np.zeros(count), np.zeros(count)

    def twist(self, mass: Array, slip_force: Array, connected: Array) -> Array:
        """Torque of the hands on the object over the period to come, (n, 3) [N·m].

        `mass` (n,) with whose inertia the object moves [kg]; `slip_force` (n,) of each hand [N]; `connected` (n, 2): 1
        for hands that hold.
        """
        hands = self._sites[:, self._layout.grips]
        axis = hands[:, 0] - hands[:, 1]
        axis /= (np.sqrt(np.vecdot(axis, axis)) + TINY)[:, None]
        turning = self._spatial[:, self._layout.hands, :3]
        relative = self._spatial[:, self._layout.object, :3] - 0.5 * (turning[:, 0] + turning[:, 1])
        rate = np.vecdot(relative, axis)
        self.angle += 0.5 * self._period * (rate + self.rate)
        self.rate[:] = rate
        inertia = self._about * mass
        stable = self._grasp.stability * inertia / self._period
        stiffness = np.minimum(self._grasp.stiffness, stable / self._period)
        holding = 0.5 * (connected[:, 0] + connected[:, 1])
        most = 2.0 * self._grasp.torsion * slip_force * holding
        reach = most / np.maximum(stiffness, TINY)
        self.angle.clip(-reach, reach, out=self.angle)
        lag = 0.5 * self._period * stiffness  # a held torque lags half a period and would drive what it should damp
        damping = np.minimum(self._grasp.swing_damping * inertia + lag, stable)
        size = (stiffness * self.angle + damping * rate).clip(-most, most)
        return axis * -size[:, None]

    def arrays(self) -> dict[str, Array]:
        """The grip's memory, by name."""
        return {"grip_angle": self.angle, "grip_rate": self.rate}
