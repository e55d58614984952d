"""The second carrier: spring and damper at the object's far handle that follow the command; a share of the load.

Planar vectors are complex numbers x + iy, so that turning is a product and length an absolute value.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.partner import Partner as Recipe
from iowbc.recipe.scene import Scene
from iowbc.sim.delay import DelayLine
from iowbc.sim.randomization import GRAVITY
from iowbc.sim.state import SimulationState

Array = NDArray[Any]
Indices = NDArray[np.int64]
Planar = NDArray[np.complex128]

NOISE_WIDTH = 2
"""Columns of noise that the partner takes each step."""


TINY = 1e-9
"""Keeps a division by a length from dividing by zero."""
REMEMBERED = (
    *("stiffness", "damping", "present", "weight", "resistance", "pace", "gust"),
    *("aim", "unsteady", "at", "speed", "arm", "height", "force", "energy"),
)


class Partner:
    """Partners of n environments. Its forces are held over a control period."""

    def __init__(self, recipe: Recipe, scenes: list[Scene], period: float) -> None:
        n = len(scenes)
        self._recipe, self._period = recipe, period
        self._double_handle = np.array([scene.object.size[0] if scene.object else 0.0 for scene in scenes])
        self._pushing = np.array([scene.kind == "push" for scene in scenes])
        self._line = DelayLine(n, 3, recipe.delay.high / period)
        self._stiffness, self._damping, self._present = np.zeros(n), np.zeros(n), np.zeros(n)
        self._weight, self._resistance, self._pace, self._gust = np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n)
        self._aim, self._unsteady = np.zeros(n, complex), np.zeros(n, complex)
        self._at, self._speed = np.zeros(n, complex), np.zeros(n, complex)
        self._arm, self._height = np.zeros(n, complex), np.zeros(n)
        self._force, self._energy = np.zeros((n, 3)), np.zeros(n)
        self._keep = float(np.exp(-period / recipe.noise_time))
        self._any = False

    def reset(self, which: Indices, drawn: dict[str, Array], state: SimulationState) -> None:
        """New partners for some environments, at rest at the handle."""
        share, mass = drawn["partner_share"][which], drawn["object_mass"][which]
        pushing = self._pushing[which]
        present = (share != 0.0) & (mass > 0.0)
        stable = self._recipe.stability * mass / self._period
        held = (present & ~pushing).astype(float)
        self._stiffness[which] = held * np.minimum(drawn["partner_stiffness"][which], stable / self._period)
        self._damping[which] = held * np.minimum(drawn["partner_damping"][which], stable)
        self._weight[which] = held * share * mass * GRAVITY
        self._resistance[which] = (present & pushing) * share * drawn["object_ground_friction"][which] * mass * GRAVITY
        self._pace[which] = drawn["partner_pace"][which]
        self._present[which] = present
        self._gust[which] = present * drawn["partner_noise"][which] * np.sqrt(1.0 - self._keep**2)
        self._line.set_latency(which, drawn["partner_delay"][which] / self._period)
        self._line.fill(which, np.zeros((len(which), 3)))
        self._unsteady[which] = 0.0
        self._energy[which] = 0.0
        self._force[which] = 0.0
        self._observe(state)
        self._aim[which] = self._at[which]
        self._any = bool(self._present.any())

    def wrench(self, commanded: Array, gust: Array, state: SimulationState, out: Array) -> None:
        """Force and torque about the object's centre of mass, written to `out` (n, 6), of the period to come.

        `commanded` (n, 3): v_x, v_y and yaw rate in the heading frame; `gust` (n, 2) standard normal.
        F = k (aim - handle) + c (v_aim - v_handle), bounded, plus unsteady force and the share of weight or resistance.
        """
        out[:] = 0.0
        if not self._any:
            return
        recipe = self._recipe
        self._line.push(commanded)
        wanted = self._line.read()
        wanted *= self._pace[:, None]
        velocity = _planar(wanted)
        velocity *= _heading(state.base_rotation)
        push = velocity / (np.abs(velocity) + TINY)
        push *= self._resistance
        around = self._at - _planar(state.base_position)
        around *= 1j
        around *= wanted[:, 2]
        velocity += around
        lead = velocity * self._period
        lead += self._aim
        lead -= self._at
        lead *= np.minimum(1.0, recipe.leash / (np.abs(lead) + TINY))
        np.add(self._at, lead, out=self._aim)
        lead *= self._stiffness
        velocity -= self._speed
        velocity *= self._damping
        lead += velocity
        lead *= np.minimum(1.0, recipe.strongest / (np.abs(lead) + TINY))
        self._unsteady *= self._keep
        self._unsteady += self._gust * _planar(gust)
        lead += self._unsteady
        lead += push
        out[:, 0], out[:, 1] = lead.real, lead.imag
        np.multiply(self._damping, state.object_linear_velocity[:, 2], out=out[:, 2])
        np.subtract(self._weight, out[:, 2], out=out[:, 2])
        lead *= self._arm.conj()
        out[:, 5] = lead.imag
        self._force[:] = out[:, :3]

    def observe(self, state: SimulationState) -> None:
        """Follows the handle over a period, and adds up the work done on it."""
        if not self._any:
            return
        before, height = self._at, self._height
        self._observe(state)
        before -= self._at
        height -= self._height
        moved = -(self._force[:, 0] * before.real + self._force[:, 1] * before.imag + self._force[:, 2] * height)
        self._energy += moved
        state.partner_force[:] = self._force
        state.partner_energy[:] = self._energy

    def _observe(self, state: SimulationState) -> None:
        w, x, y, z = state.object_quaternion.T
        arm = np.empty(len(w), complex)
        arm.real = 0.5 - (y * y + z * z)
        arm.imag = w * z + x * y
        arm *= self._double_handle
        self._at = _planar(state.object_position) + arm
        self._height = state.object_position[:, 2].copy()
        self._arm = arm
        self._speed = _planar(state.object_linear_velocity) + 1j * state.object_angular_velocity[:, 2] * arm

    def handle(self, env: int) -> Array:
        """The far handle of one environment's object, (3,) [m]."""
        return np.array([self._at[env].real, self._at[env].imag, self._height[env]])

    def arrays(self) -> dict[str, Array]:
        """The partners' memory, by name."""
        own = {name: getattr(self, f"_{name}") for name in REMEMBERED}
        return own | {f"line/{name}": values for name, values in self._line.arrays().items()}

    def restored(self) -> None:
        """To be called after the memory was written from outside."""
        self._any = bool(self._present.any())


def _planar(vectors: Array) -> Planar:
    """First two columns as complex numbers, (n, k) to (n,)."""
    out = np.empty(len(vectors), complex)
    out.real, out.imag = vectors[:, 0], vectors[:, 1]
    return out


def _heading(rotation: Array) -> Planar:
    """Direction of the frames' x axes in the plane, of length one; (n, 3, 3) to (n,)."""
    forward = _planar(rotation[:, :2, 0])
    forward /= np.abs(forward) + TINY
    return forward
