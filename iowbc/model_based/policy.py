"""The quadratic program as a policy: joint targets from the observation of the student, and an estimate of motion."""

import numpy as np
import pinocchio
from scipy.linalg import solve_discrete_are

from iowbc.arrays import Array, Mask
from iowbc.control.action import action_scale
from iowbc.control.command import HEIGHT, PITCH
from iowbc.control.observation import observation_layout
from iowbc.errors import Rejected
from iowbc.model_based.balance import Balance
from iowbc.recipe.evaluation.baselines import Estimation
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot

SMALLEST_NOISE = 1e-6
"""Standard deviation [rad, rad/s] that stands for a sensor without noise: the filter divides by it."""


class ModelPolicy:
    """Acts in n environments independently, with a motion estimate for each.

    With q the joints (extrapolated by `lead`), τ the program's torques and v⁺ the planned joint velocities, the target
    of the joint controllers is q + (τ + kd v⁺) / kp, so that they apply τ if the robot moves as planned.
    """

    def __init__(self, robot: Robot, recipe: Recipe) -> None:
        self._robot, self._settings = robot, recipe.eval.model
        self._balance = Balance(robot, self._settings)
        self._places = observation_layout(robot, recipe.task.observation.observe_object).slices
        self._scale, self._period = action_scale(robot, recipe.task.action), 1.0 / recipe.task.control_frequency
        self._kp, self._kd = robot.kp[robot.support], robot.kd[robot.support]
        self._gains = motion_gains(len(self._scale), self._period, self._settings.estimation)
        self._motions: list[Motion | None] = []

    def reset(self, which: Mask) -> None:
        if len(self._motions) != len(which):
            self._motions = [None] * len(which)
        for index in np.flatnonzero(which):
            self._motions[index] = None

    def act(self, observation: Array, privileged: Array) -> Array:
        """Residual action, shape (n, A), from s_t, shape (n, S). Rows of zeros, which belong to no trial, stay zero."""
        rows = observation.astype(np.float64)
        action = np.zeros((len(rows), len(self._scale)))
        for index in np.flatnonzero(rows.any(axis=1)):
            action[index] = self._act(int(index), rows[index])
        return action.astype(np.float32)

    def _act(self, index: int, row: Array) -> Array:
        """Action of one environment; the previous one if the program has no solution."""
        robot, balance = self._robot, self._balance
        seen = {name: row[place] for name, place in self._places.items()}
        reference, gravity = seen["support_reference"], seen["projected_gravity"]
        joints = reference + seen["joint_position"][robot.support]
        rates = np.concatenate([seen["base_angular_velocity"], seen["joint_velocity"][robot.support]])
        motion = self._motions[index] = self._motions[index] or Motion(gravity, joints, self._gains, self._period)
        motion.correct(gravity, joints, rates)
        q = balance.configuration(motion.gravity, motion.joints)
        v = balance.velocity(q, motion.rates)
        ahead = pinocchio.integrate(balance.model, q, self._settings.lead * v)
        try:
            solution = balance.solve(ahead, v, seen["arm_reference"], seen["command"][[HEIGHT, PITCH]], reference)
        except Rejected:
            motion.advance(np.zeros(len(rates)))
            return seen["last_action"]
        motion.advance(solution.acceleration[3:])
        planned = v[6:] + self._period * solution.acceleration[6:]
        target = ahead[7:] + (solution.torque + self._kd * planned) / self._kp
        return (target - reference) / self._scale


class Motion:
    """Direction of gravity, joint positions, angular rates, and unplanned accelerations of a robot, by a steady-state
    Kalman filter around the planned accelerations."""

    def __init__(self, gravity: Array, joints: Array, gains: Array, period: float) -> None:
        """A robot at rest; `gains`: those of `motion_gains`."""
        self._gains, self._period = gains, period
        self.gravity, self.joints = gravity, joints
        self.rates, self.unplanned = np.zeros(len(gains)), np.zeros(len(gains))

    def correct(self, gravity: Array, joints: Array, rates: Array) -> None:
        """Updates with measurements: gravity in the base frame (3,), joints (k,) [rad], and rates of the base (base
        frame) and of the joints (3 + k,) [rad/s]."""
        turned = np.cross(gravity, self.gravity)
        surprise = np.stack([np.concatenate([turned, joints - self.joints]), rates - self.rates], axis=1)
        angle, rate, unplanned = np.einsum("kij,kj->ik", self._gains, surprise)
        self._turn(angle)
        self.rates = self.rates + rate
        self.unplanned = self.unplanned + unplanned

    def advance(self, planned: Array) -> None:
        """Predicts one control period with planned accelerations, (3 + k,) [rad/s²]."""
        change = self._period * (planned + self.unplanned)
        self._turn(self._period * (self.rates + 0.5 * change))
        self.rates = self.rates + change

    def _turn(self, angle: Array) -> None:
        turned = self.gravity - np.cross(angle[:3], self.gravity)
        self.gravity = turned / np.linalg.norm(turned)
        self.joints = self.joints + angle[3:]


def motion_gains(joints: int, period: float, settings: Estimation) -> Array:
    """Kalman gains of the base's tilt and of each joint, (3 + joints, 3, 2)."""
    base = filter_gains(period, settings, settings.gravity_noise, settings.gyro_noise)
    joint = filter_gains(period, settings, settings.position_noise, settings.velocity_noise)
    return np.concatenate([np.tile(base, (3, 1, 1)), np.tile(joint, (joints, 1, 1))])


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
