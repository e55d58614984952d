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


REMEMBERED = (
    *("stiffness", "damping", "present", "weight", "resistance", "pace", "gust"),
    *("aim", "unsteady", "at", "speed", "arm", "height", "force", "energy"),
)


class Partner:
    """Partners of n environments. Its forces are held over a control period."""

    def __init__(self, recipe: Recipe, scenes: list[Scene], period: float) -> None:
        n = len(scenes)
        self._recipe, self._period = recipe, period
        self._handle = np.array([0.5 * scene.object.size[0] if scene.object else 0.0 for scene in scenes])
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
        self._line.push(commanded)
        wanted = self._line.read() * self._pace[:, None]
        heading = _heading(state.base_quaternion)
        velocity = heading * _planar(wanted)
        direction = velocity / np.maximum(np.abs(velocity), 1e-9)
        velocity += 1j * wanted[:, 2] * (self._at - _planar(state.base_position))
        lead = self._aim + self._period * velocity - self._at
        lead *= np.minimum(1.0, self._recipe.leash / np.maximum(np.abs(lead), 1e-9))
        self._aim = self._at + lead
        pull = self._stiffness * lead + self._damping * (velocity - self._speed)
        pull *= np.minimum(1.0, self._recipe.strongest / np.maximum(np.abs(pull), 1e-9))
        self._unsteady *= self._keep
        self._unsteady += self._gust * _planar(gust)
        pull += self._unsteady + self._resistance * direction
        out[:, 0], out[:, 1] = pull.real, pull.imag
        out[:, 2] = self._weight - self._damping * state.object_linear_velocity[:, 2]
        out[:, 5] = (self._arm.conj() * pull).imag
        self._force[:] = out[:, :3]

    def observe(self, state: SimulationState) -> None:
        """Follows the handle over a period, and adds up the work done on it."""
        if self._any:
            before, height = self._at, self._height
            self._observe(state)
            moved = self._at - before
            self._energy += self._force[:, 0] * moved.real + self._force[:, 1] * moved.imag
            self._energy += self._force[:, 2] * (self._height - height)
        state.partner_force[:] = self._force
        state.partner_energy[:] = self._energy

    def _observe(self, state: SimulationState) -> None:
        w, x, y, z = state.object_quaternion.T
        self._arm = self._handle * ((1.0 - 2.0 * (y * y + z * z)) + 2j * (w * z + x * y))
        self._at = _planar(state.object_position) + self._arm
        self._speed = _planar(state.object_linear_velocity) + 1j * state.object_angular_velocity[:, 2] * self._arm
        self._height = state.object_position[:, 2].copy()

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


def _heading(quaternion: Array) -> Planar:
    """Direction of the frames' x axes in the plane, of length one; (n, 4) to (n,)."""
    w, x, y, z = quaternion.T
    forward = (1.0 - 2.0 * (y * y + z * z)) + 2j * (w * z + x * y)
    direction: Planar = forward / np.maximum(np.abs(forward), 1e-9)
    return direction
