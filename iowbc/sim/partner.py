"""The second carrier: spring and damper at the object's far handle that follow the command; a share of the load.

Planar vectors are rows x and y of arrays (2, n). All is real sums, products and roots, which round alike however many
environments there are; NumPy's complex products do not.
"""

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.simulation.partner import Partner as Recipe
from iowbc.recipe.simulation.scene import Scene
from iowbc.robot.description import GRAVITY
from iowbc.sim.delay import DelayLine
from iowbc.sim.state import SimulationState

NOISE_WIDTH = 2
"""Columns of noise that the partner takes each step."""


TINY = 1e-9
"""Keeps a division by a length from dividing by zero."""
REMEMBERED = (
    *("stiffness", "damping", "present", "weight", "resistance", "pace", "gust"),
    *("height", "force", "energy"),
)
PLANAR = ("aim", "unsteady", "at", "speed", "arm")
"""What partners remember; planar vectors are (2, n) here and (n, 2) to others."""


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
        self._aim, self._unsteady = np.zeros((2, n)), np.zeros((2, n))
        self._at, self._speed = np.zeros((2, n)), np.zeros((2, n))
        self._arm, self._height = np.zeros((2, n)), np.zeros(n)
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
        self._unsteady[:, which] = 0.0
        self._energy[which] = 0.0
        self._force[which] = 0.0
        self._observe(state)
        self._aim[:, which] = self._at[:, which]
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
        velocity = _turned(_heading(state.base_rotation), _planar(wanted))
        push = velocity * (self._resistance / (_length(velocity) + TINY))
        around = self._at - _planar(state.base_position)
        around *= wanted[:, 2]
        velocity[0] -= around[1]
        velocity[1] += around[0]
        lead = velocity * self._period
        lead += self._aim
        lead -= self._at
        lead *= np.minimum(1.0, recipe.leash / (_length(lead) + TINY))
        np.add(self._at, lead, out=self._aim)
        lead *= self._stiffness
        velocity -= self._speed
        velocity *= self._damping
        lead += velocity
        lead *= np.minimum(1.0, recipe.strongest / (_length(lead) + TINY))
        self._unsteady *= self._keep
        self._unsteady += self._gust * _planar(gust)
        lead += self._unsteady
        lead += push
        out[:, :2] = lead.T
        out[:, 2] = self._weight - self._damping * state.object_linear_velocity[:, 2]
        out[:, 5] = self._arm[0] * lead[1] - self._arm[1] * lead[0]
        self._force[:] = out[:, :3]

    def observe(self, state: SimulationState) -> None:
        """Follows the handle over a period, and adds up the work done on it."""
        if not self._any:
            return
        before, height = self._at, self._height
        self._observe(state)
        before -= self._at
        height -= self._height
        self._energy -= self._force[:, 0] * before[0] + self._force[:, 1] * before[1] + self._force[:, 2] * height
        state.partner_force[:] = self._force
        state.partner_energy[:] = self._energy

    def _observe(self, state: SimulationState) -> None:
        w, x, y, z = state.object_quaternion.T
        arm = np.empty((2, len(w)))
        arm[0] = 0.5 - (y * y + z * z)
        arm[1] = w * z + x * y
        arm *= self._double_handle
        turning = state.object_angular_velocity[:, 2]
        self._speed = _planar(state.object_linear_velocity)
        self._speed[0] -= turning * arm[1]
        self._speed[1] += turning * arm[0]
        self._at = _planar(state.object_position)
        self._at += arm
        self._arm, self._height = arm, state.object_position[:, 2].copy()

    def handle(self, env: int) -> Array:
        """The far handle of one environment's object, (3,) [m]."""
        return np.array([self._at[0, env], self._at[1, env], self._height[env]])

    def arrays(self) -> dict[str, Array]:
        """The partners' memory, by name."""
        own = {name: getattr(self, f"_{name}") for name in REMEMBERED}
        own |= {name: getattr(self, f"_{name}").T for name in PLANAR}
        return own | {f"line/{name}": values for name, values in self._line.arrays().items()}

    def restored(self) -> None:
        """To be called after the memory was written from outside."""
        self._any = bool(self._present.any())
        self._line.restored()


def _planar(vectors: Array) -> Array:
    """First two columns as rows, (n, k) to (2, n)."""
    rows: Array = vectors[:, :2].T.copy()
    return rows


def _length(vectors: Array) -> Array:
    """Lengths of planar vectors, (2, n) to (n,)."""
    squares = vectors * vectors
    length: Array = np.sqrt(squares[0] + squares[1])
    return length


def _turned(direction: Array, vectors: Array) -> Array:
    """Planar vectors turned by the angle that a unit vector makes with the x axis, (2, n) each."""
    turned: Array = direction[0] * vectors
    turned[0] -= direction[1] * vectors[1]
    turned[1] += direction[1] * vectors[0]
    return turned


def _heading(rotation: Array) -> Array:
    """Direction of the frames' x axes in the plane, of length one; (n, 3, 3) to (2, n)."""
    forward = _planar(rotation[:, :, 0])
    forward /= _length(forward) + TINY
    return forward
