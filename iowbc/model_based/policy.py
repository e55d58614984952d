"""The quadratic program as a policy: joint targets from the observation of the student."""

import numpy as np
import pinocchio

from iowbc.arrays import Array, Mask
from iowbc.control.action import action_scale
from iowbc.control.command import HEIGHT, PITCH
from iowbc.control.observation import observation_layout
from iowbc.errors import Rejected
from iowbc.model_based.balance import Balance
from iowbc.model_based.estimate import MotionFilter
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot


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
        self._motion = self._filter(0)
        self._starts = np.ones(0, np.bool_)

    def reset(self, which: Mask) -> None:
        if self._starts.shape != which.shape:
            self._starts = np.ones(which.shape, np.bool_)
            self._motion = self._filter(len(which))
        self._starts |= which

    def act(self, observation: Array, privileged: Array) -> Array:
        """Residual action, shape (n, A), from s_t, shape (n, S). Rows of zeros, which belong to no trial, stay zero."""
        rows = observation.astype(np.float64)
        action = np.zeros((len(rows), len(self._scale)))
        for index in np.flatnonzero(rows.any(axis=1)):
            action[index] = self._act(int(index), rows[index])
        return action.astype(np.float32)

    def _act(self, index: int, row: Array) -> Array:
        """Action of one environment; the previous one if the program has no solution."""
        robot, balance, motion = self._robot, self._balance, self._motion
        seen = {name: row[place] for name, place in self._places.items()}
        reference, gravity = seen["support_reference"], seen["projected_gravity"]
        joints = reference + seen["joint_position"][robot.support]
        rates = np.concatenate([seen["base_angular_velocity"], seen["joint_velocity"][robot.support]])
        if self._starts[index]:
            motion.begin(index, gravity, joints)
            self._starts[index] = False
        motion.correct(index, gravity, joints, rates)
        q = balance.configuration(motion.gravity[index], motion.joints[index])
        v = balance.velocity(q, motion.rates[index])
        ahead = pinocchio.integrate(balance.model, q, self._settings.lead * v)
        try:
            solution = balance.solve(ahead, v, seen["arm_reference"], seen["command"][[HEIGHT, PITCH]], reference)
        except Rejected:
            motion.advance(index, np.zeros(len(rates)))
            return seen["last_action"]
        motion.advance(index, solution.acceleration[3:])
        planned = v[6:] + self._period * solution.acceleration[6:]
        target = ahead[7:] + (solution.torque + self._kd * planned) / self._kp
        return (target - reference) / self._scale

    def _filter(self, n: int) -> MotionFilter:
        return MotionFilter(n, len(self._scale), self._period, self._settings.estimation)
