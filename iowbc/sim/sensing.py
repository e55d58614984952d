"""Sensor model: the true state with bias, noise and latency."""

import numpy as np

from iowbc.arrays import Array, Indices, Mask, places
from iowbc.control.sensors import Measured
from iowbc.recipe.simulation.simulation import SensorNoise as Recipe
from iowbc.robot import rotations
from iowbc.sim.state import SimulationState
from iowbc.sim.timing import DelayLine

OBJECT_WIDTH = 13
NOT_SEEN = np.eye(1, OBJECT_WIDTH, 3)[0]
"""Measurement without an object: identity, at rest at the base."""
CONJUGATE_PLACES = np.array([0, 1, 2, 3, 1, 0, 3, 2, 2, 3, 0, 1, 3, 2, 1, 0])
CONJUGATE_SIGNS = np.array([1, 1, 1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1.0])
"""Matrix, row by row, of the left multiplication by a quaternion's conjugate."""


class Sensing:
    """Sensors of n environments; two delay lines, one for joints and inertial unit, one for the object's tracking."""

    def __init__(self, recipe: Recipe, joints: int, has_object: Mask, longest_latency: int, period: float) -> None:
        n, self._period = len(has_object), period
        quantities = _quantities(recipe, joints)
        sizes, deviations = zip(*quantities.values(), strict=True)
        columns = places(dict(zip(quantities, sizes, strict=True)))
        self.noise_width = sum(sizes)
        """Noise columns that sensing uses per step."""
        self._width = width = columns["heading"].stop
        """Columns of the robot's own quantities; those of the object come last."""
        self._inertial = slice(columns["base_angular_velocity"].start, columns["projected_gravity"].stop)
        self._see_object, self._all_see = bool(has_object.any()), bool(has_object.all())
        true = np.zeros((n, self.noise_width))
        self._sensed = {name: true[:, place] for name, place in columns.items()}
        """Measurements without noise and latency; the heading is unwrapped for the delay line."""
        self._robot, self._object = true[:, :width], true[:, width:]
        self._robot_line = DelayLine(n, width, longest_latency)
        self._object_line = DelayLine(n, OBJECT_WIDTH, longest_latency)
        self._bias = np.zeros((n, joints))
        self._mounting, self._gyro_bias = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        self._drift, self._drifted = np.zeros(n), np.zeros(n)
        self._deviation = np.zeros((n, self.noise_width))
        self._nominal = np.repeat(deviations, sizes)
        self.rows = np.zeros((n, self.noise_width))
        self._quaternion = self.rows[:, columns["object_quaternion"]]
        self.measured = Measured(**{name: self.rows[:, place] for name, place in columns.items()})

    def reset(self, which: Indices, drawn: dict[str, Array], state: SimulationState) -> None:
        """Fills the delay lines of some environments with their current state."""
        self._bias[which] = drawn["encoder_bias"][which]
        roll, pitch = drawn["imu_tilt"][which].T
        self._mounting[which] = rotations.matrix(rotations.from_euler(roll, pitch, np.zeros_like(roll)))
        self._gyro_bias[which] = drawn["gyro_bias"][which]
        self._drift[which], self._drifted[which] = drawn["heading_drift"][which], 0.0
        self._deviation[which] = self._nominal * drawn["noise_scale"][which, None]
        self._deviation[which, self._width :] *= state.has_object[which, None]
        self._robot_line.set_latency(which, drawn["sensor_latency"][which])
        self._object_line.set_latency(which, drawn["object_latency"][which])
        self._sensed["heading"][which] = 0.0  # it is unwrapped from here on
        self._sense(state)
        self._robot_line.fill(which, self._robot[which])
        self._object_line.fill(which, self._object[which])

    def advance(self, state: SimulationState) -> None:
        """Adds the state after a period to the delay lines."""
        self._drifted += self._drift * self._period
        self._sense(state)
        self._robot_line.push(self._robot)
        self._object_line.push(self._object)

    def deliver(self, noise: Array) -> None:
        """Refreshes `measured`; `noise` (n, noise_width) standard normal."""
        rows, width = self.rows, self._width
        np.multiply(noise, self._deviation, out=rows)
        seen = self._robot_line.read()
        inertial = seen[:, self._inertial].reshape(-1, 2, 3)
        inertial[...] = inertial @ self._mounting
        inertial[:, 0] += self._gyro_bias
        rows[:, :width] += seen
        self.measured.joint_position[:] += self._bias
        quaternion = self._quaternion
        if not self._see_object:
            quaternion[:, 0] = 1.0
            return
        rows[:, width:] += self._object_line.read()
        quaternion /= np.sqrt(np.vecdot(quaternion, quaternion))[:, None]

    def _sense(self, state: SimulationState) -> None:
        sensed, rotation = self._sensed, state.base_rotation
        sensed["joint_position"][:], sensed["joint_velocity"][:] = state.joint_position, state.joint_velocity
        sensed["base_angular_velocity"][:] = state.base_angular_velocity
        np.negative(rotation[:, 2], out=sensed["projected_gravity"])
        heading = sensed["heading"][:, 0]
        heading += rotations.wrapped(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]) + self._drifted - heading)
        if not self._see_object:
            return
        turning, away = state.base_angular_velocity, state.object_position - state.base_position
        velocity = state.object_linear_velocity - state.base_linear_velocity
        seen = np.stack([away, velocity, state.object_angular_velocity], axis=1) @ rotation
        sensed["object_position"][:] = place = seen[:, 0]
        np.subtract(seen[:, 1], rotations.cross(turning, place), out=sensed["object_linear_velocity"])
        np.subtract(seen[:, 2], turning, out=sensed["object_angular_velocity"])
        left = state.base_quaternion.take(CONJUGATE_PLACES, axis=1)
        left *= CONJUGATE_SIGNS
        relative = (left.reshape(-1, 4, 4) @ state.object_quaternion[:, :, None])[:, :, 0]
        relative *= np.copysign(1.0, relative[:, :1])
        sensed["object_quaternion"][:] = relative
        if not self._all_see:
            self._object[~state.has_object] = NOT_SEEN

    def arrays(self) -> dict[str, Array]:
        own = {"mounting": self._mounting, "gyro_bias": self._gyro_bias}
        own |= {"drift": self._drift, "drifted": self._drifted}
        own |= {"bias": self._bias, "deviation": self._deviation, "rows": self.rows, "sensed": self._robot}
        for name, line in (("robot", self._robot_line), ("object", self._object_line)):
            own |= {f"{name}/{key}": values for key, values in line.arrays().items()}
        return own


def _quantities(recipe: Recipe, joints: int) -> dict[str, tuple[int, float]]:
    """Quantities of `Measured` in the order of a row: number of columns and standard deviation of the noise. A rotation
    by η changes a unit quaternion by η / 2."""
    return {
        "joint_position": (joints, recipe.joint_position),
        "joint_velocity": (joints, recipe.joint_velocity),
        "base_angular_velocity": (3, recipe.angular_velocity),
        "projected_gravity": (3, recipe.gravity),
        "heading": (1, recipe.heading),
        "object_position": (3, recipe.object_position),
        "object_quaternion": (4, 0.5 * recipe.object_orientation),
        "object_linear_velocity": (3, recipe.object_velocity),
        "object_angular_velocity": (3, recipe.object_angular_velocity),
    }
