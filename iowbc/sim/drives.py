"""Torque limits of the motors: drawn strength, reduced at high speed, shared by the two joints of a linkage."""

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.simulation.simulation import Physics
from iowbc.robot.description import Robot
from iowbc.sim.state import SimulationState


class Drives:
    """Torque limits of n environments, from the state at the start of each control period."""

    def __init__(self, robot: Robot, physics: Physics, n: int) -> None:
        self._robot = robot
        self.effort = np.tile(robot.effort, (n, 1))
        """Torque limit of each motor or linkage in these episodes at low speed, (n, joints) [N·m]."""
        self._slope = 1.0 / ((1.0 - physics.torque_corner) * robot.velocity_limit)
        self._at_rest = self._slope * robot.velocity_limit
        """Torque at rest, extrapolated from the slope, as a multiple of the limit."""
        self._kp, self._kd = robot.kp[robot.linkages], robot.kd[robot.linkages]

    def reset(self, which: Indices, drawn: dict[str, Array]) -> None:
        self.effort[which] = drawn_effort(self._robot, drawn["motor_strength"][which], drawn["linkage_effort"][which])

    def ranges(self, target: Array, state: SimulationState) -> Array:
        """Least and greatest torque of each motor over the next period, (n, joints, 2) [N·m]; `target` (n, joints)
        [rad].

        A motor that drives gives its full torque up to a corner speed and less beyond, down to nothing at its no-load
        speed; a motor that brakes gives all. The joints a, b of a linkage are moved by two motors together:
        |τ_a| + |τ_b| ≤ the linkage's limit, split by what nominal joint control of the newest target demands. The split
        is kept for the whole period, while the demand changes: in up to 4 % of the periods the sum exceeds the limit,
        by up to a fifth.
        """
        effort = self.effort.copy()
        self._share(effort, target, state)
        reserve = state.joint_velocity * self._slope
        least = -effort * (self._at_rest + reserve).clip(0.0, 1.0)
        return np.stack([least, effort * (self._at_rest - reserve).clip(0.0, 1.0)], axis=-1)

    def _share(self, effort: Array, target: Array, state: SimulationState) -> None:
        pairs = self._robot.linkages
        if not len(pairs):
            return
        wanted = self._kp * (target - state.joint_position).take(pairs, axis=1)
        wanted -= self._kd * state.joint_velocity.take(pairs, axis=1)
        np.abs(wanted, out=wanted)
        np.copyto(wanted, 0.0, where=np.isnan(wanted))
        limit = effort.take(pairs, axis=1)
        both = wanted[..., 0] + wanted[..., 1]
        scale = np.minimum(1.0, limit[..., 0] / np.maximum(both, 1e-9))
        effort[:, pairs] = limit - wanted[..., ::-1] * scale[..., None]


def drawn_effort(robot: Robot, strength: Array, linkage_effort: Array) -> Array:
    """Torque limits at low speed, (n, joints) [N·m]; drawn strengths (n, joints), limits of linkages (n, linkages),
    or (n,) of a single one."""
    effort, pairs = robot.effort * strength, robot.linkages
    effort[:, pairs] = (linkage_effort.reshape(len(strength), -1) * strength[:, pairs].mean(axis=2))[..., None]
    return effort
