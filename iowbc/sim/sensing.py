"""Sensor model: the true state with bias, noise and latency."""

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.control.sensors import Measured
from iowbc.recipe.simulation.simulation import SensorNoise as Recipe
from iowbc.robot import rotations
from iowbc.sim.delay import DelayLine
from iowbc.sim.state import SimulationState

PLACE, ORIENTATION = slice(0, 3), slice(3, 7)
SPEED, TURNING = slice(7, 10), slice(10, 13)
OBJECT_WIDTH = 13
NOT_SEEN = np.zeros(OBJECT_WIDTH)
NOT_SEEN[ORIENTATION.start] = 1.0
"""Measurement without an object: identity, at rest at the base."""
CONJUGATE_PLACES = np.array([0, 1, 2, 3, 1, 0, 3, 2, 2, 3, 0, 1, 3, 2, 1, 0])
CONJUGATE_SIGNS = np.array([1, 1, 1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1.0])
"""Matrix, row by row, of the left multiplication by a quaternion's conjugate."""


class Columns:
    """Columns of a robot's measurements in a row, before those of the object."""

    def __init__(self, joints: int) -> None:
        self.position, self.velocity = slice(0, joints), slice(joints, 2 * joints)
        self.angular, self.gravity = slice(2 * joints, 2 * joints + 3), slice(2 * joints + 3, 2 * joints + 6)
        self.heading = slice(2 * joints + 6, 2 * joints + 7)
        self.inertial = slice(2 * joints, 2 * joints + 6)
        self.robot = slice(0, 2 * joints + 7)
        self.width = self.robot.stop + OBJECT_WIDTH


class Sensing:
    """Sensors of n environments; two delay lines, one for joints and inertial unit, one for the object's tracking."""

    def __init__(self, recipe: Recipe, joints: int, has_object: Mask, longest_latency: int, period: float) -> None:
        n, self._period = len(has_object), period
        self._columns = columns = Columns(joints)
        self.noise_width = columns.width
        """Noise columns that sensing uses per step."""
        self._see_object, self._all_see = bool(has_object.any()), bool(has_object.all())
        self._world = np.zeros((n, 3, 3))
        width = columns.robot.stop
        self._robot, self._object = np.zeros((n, width)), np.zeros((n, OBJECT_WIDTH))
        self._robot_line = DelayLine(n, width, longest_latency)
        self._object_line = DelayLine(n, OBJECT_WIDTH, longest_latency)
        self._bias = np.zeros((n, joints))
        self._mounting, self._gyro_bias = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        self._drift, self._drifted = np.zeros(n), np.zeros(n)
        self._deviation = np.zeros((n, columns.width))
        self._nominal = _deviations(recipe, columns)
        self.rows = np.zeros((n, columns.width))
        seen = self.rows[:, width:]
        self.measured = Measured(
            joint_position=self.rows[:, columns.position],
            joint_velocity=self.rows[:, columns.velocity],
            base_angular_velocity=self.rows[:, columns.angular],
            projected_gravity=self.rows[:, columns.gravity],
            heading=self.rows[:, columns.heading],
            object_position=seen[:, PLACE],
            object_quaternion=seen[:, ORIENTATION],
            object_linear_velocity=seen[:, SPEED],
            object_angular_velocity=seen[:, TURNING],
        )

    def reset(self, which: Indices, drawn: dict[str, Array], state: SimulationState) -> None:
        """Fills the delay lines of some environments with their current state."""
        self._bias[which] = drawn["encoder_bias"][which]
        roll, pitch = drawn["imu_tilt"][which].T
        self._mounting[which] = rotations.matrix(rotations.from_euler(roll, pitch, np.zeros_like(roll)))
        self._gyro_bias[which] = drawn["gyro_bias"][which]
        self._drift[which], self._drifted[which] = drawn["heading_drift"][which], 0.0
        self._deviation[which] = self._nominal * drawn["noise_scale"][which, None]
        self._deviation[which, self._columns.robot.stop :] *= state.has_object[which, None]
        self._robot_line.set_latency(which, drawn["sensor_latency"][which])
        self._object_line.set_latency(which, drawn["object_latency"][which])
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
        rows, columns = self.rows, self._columns
        np.multiply(noise, self._deviation, out=rows)
        seen = self._robot_line.read()
        inertial = seen[:, columns.inertial].reshape(-1, 2, 3)
        inertial[...] = inertial @ self._mounting
        inertial[:, 0] += self._gyro_bias
        rows[:, columns.robot] += seen
        rows[:, columns.position] += self._bias
        quaternion = rows[:, columns.robot.stop :][:, ORIENTATION]
        if not self._see_object:
            quaternion[:, 0] = 1.0
            return
        rows[:, columns.robot.stop :] += self._object_line.read()
        quaternion /= np.sqrt(np.vecdot(quaternion, quaternion))[:, None]

    def _sense(self, state: SimulationState) -> None:
        """Computes measurements without noise and latency; the heading is unwrapped for the delay line."""
        robot, thing, columns = self._robot, self._object, self._columns
        robot[:, columns.position] = state.joint_position
        robot[:, columns.velocity] = state.joint_velocity
        robot[:, columns.angular] = state.base_angular_velocity
        np.negative(state.base_rotation[:, 2], out=robot[:, columns.gravity])
        rotation = state.base_rotation
        heading = robot[:, columns.heading.start]
        turned = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]) + self._drifted - heading
        heading += rotations.wrapped(turned)
        if not self._see_object:
            return
        world, turning = self._world, state.base_angular_velocity
        np.subtract(state.object_position, state.base_position, out=world[:, 0])
        np.subtract(state.object_linear_velocity, state.base_linear_velocity, out=world[:, 1])
        world[:, 2] = state.object_angular_velocity
        seen = world @ state.base_rotation
        place = seen[:, 0]
        thing[:, PLACE] = place
        np.subtract(seen[:, 1], rotations.cross(turning, place), out=thing[:, SPEED])
        np.subtract(seen[:, 2], turning, out=thing[:, TURNING])
        left = state.base_quaternion.take(CONJUGATE_PLACES, axis=1)
        left *= CONJUGATE_SIGNS
        relative = (left.reshape(-1, 4, 4) @ state.object_quaternion[:, :, None])[:, :, 0]
        relative *= np.copysign(1.0, relative[:, :1])
        thing[:, ORIENTATION] = relative
        if not self._all_see:
            thing[~state.has_object] = NOT_SEEN

    def arrays(self) -> dict[str, Array]:
        own = {"mounting": self._mounting, "gyro_bias": self._gyro_bias}
        own |= {"drift": self._drift, "drifted": self._drifted}
        own |= {"bias": self._bias, "deviation": self._deviation, "rows": self.rows, "sensed": self._robot}
        for name, line in (("robot", self._robot_line), ("object", self._object_line)):
            own |= {f"{name}/{key}": values for key, values in line.arrays().items()}
        return own


def _deviations(recipe: Recipe, columns: Columns) -> Array:
    """Standard deviation of each column, (width,); a rotation by η changes a unit quaternion by η / 2."""
    deviation = np.zeros(columns.width)
    deviation[columns.position], deviation[columns.velocity] = recipe.joint_position, recipe.joint_velocity
    deviation[columns.angular], deviation[columns.gravity] = recipe.angular_velocity, recipe.gravity
    deviation[columns.heading] = recipe.heading
    seen = deviation[columns.robot.stop :]
    seen[PLACE], seen[ORIENTATION] = recipe.object_position, 0.5 * recipe.object_orientation
    seen[SPEED], seen[TURNING] = recipe.object_velocity, recipe.object_angular_velocity
    return deviation
