"""Motion estimate from noisy angles and rates: a steady-state Kalman filter around the planned accelerations."""

import numpy as np
from scipy.linalg import solve_discrete_are

from iowbc.arrays import Array
from iowbc.recipe.evaluation.model_based import Estimation

SMALLEST_NOISE = 1e-6
"""Standard deviation [rad, rad/s] that stands for a sensor without noise: the filter divides by it."""
TILT = slice(0, 3)


def filter_gains(period: float, settings: Estimation, angle: float, rate: float) -> Array:
    """Kalman gains: from the innovation of angle and rate to angle, rate and unplanned acceleration, (3, 2).

    `angle` [rad] and `rate` [rad/s]: standard deviations of the measurements. The model over a period T is x⁺ = [[1, T,
    T²/2], [0, 1, T], [0, 0, 1]] x + [T²/2, T, 0] · planned acceleration.
    """
    step = np.array([[1.0, period, 0.5 * period**2], [0.0, 1.0, period], [0.0, 0.0, 1.0]])
    seen = np.eye(2, 3)
    push = np.array([0.5 * period**2, period, 0.0]) * settings.model_error
    process = np.outer(push, push) + np.diag([0.0, 0.0, period * settings.load_drift**2])
    noise = np.diag(np.maximum([angle, rate], SMALLEST_NOISE) ** 2)
    covariance = solve_discrete_are(step.T, seen.T, process, noise)
    return np.linalg.solve(seen @ covariance @ seen.T + noise, seen @ covariance).T


class MotionFilter:
    """Direction of gravity, joint positions, angular rates, and unplanned accelerations, of n robots."""

    def __init__(self, n: int, joints: int, period: float, settings: Estimation) -> None:
        base = filter_gains(period, settings, settings.gravity_noise, settings.gyro_noise)
        joint = filter_gains(period, settings, settings.position_noise, settings.velocity_noise)
        self._gains = np.concatenate([np.tile(base, (3, 1, 1)), np.tile(joint, (joints, 1, 1))])
        self._period = period
        self.gravity, self.joints = np.zeros((n, 3)), np.zeros((n, joints))
        self.rates, self.unplanned = np.zeros((n, 3 + joints)), np.zeros((n, 3 + joints))

    def begin(self, index: int, gravity: Array, joints: Array) -> None:
        """Resets a robot, at rest."""
        self.gravity[index], self.joints[index] = gravity, joints
        self.rates[index], self.unplanned[index] = 0.0, 0.0

    def correct(self, index: int, gravity: Array, joints: Array, rates: Array) -> None:
        """Updates with measurements: gravity in the base frame (3,), joints (k,) [rad], and rates of the base (base
        frame) and of the joints (3 + k,) [rad/s]."""
        turned = np.cross(gravity, self.gravity[index])
        surprise = np.stack([np.concatenate([turned, joints - self.joints[index]]), rates - self.rates[index]], axis=1)
        angle, rate, unplanned = np.einsum("kij,kj->ik", self._gains, surprise)
        self._turn(index, angle)
        self.rates[index] += rate
        self.unplanned[index] += unplanned

    def advance(self, index: int, planned: Array) -> None:
        """Predicts one control period with planned accelerations, (3 + k,) [rad/s²]."""
        change = self._period * (planned + self.unplanned[index])
        self._turn(index, self._period * (self.rates[index] + 0.5 * change))
        self.rates[index] += change

    def _turn(self, index: int, angle: Array) -> None:
        turned = self.gravity[index] - np.cross(angle[TILT], self.gravity[index])
        self.gravity[index] = turned / np.linalg.norm(turned)
        self.joints[index] += angle[TILT.stop :]
