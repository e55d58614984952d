"""Torques with which the arms carry their own weight, and a load in the hands: a feed-forward for their motors."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.arms import arm_chains
from iowbc.control.chain import Chain, Weights
from iowbc.robot.description import GRAVITY, Robot

AXES = np.eye(3)[:, :, None, None]
"""The unit vectors side by side, as `Chain.carry` takes them."""


class ArmGravity:
    """Static torques of both arms, many robots at once. Holds constants only."""

    def __init__(self, robot: Robot) -> None:
        chains, waist = arm_chains(robot)
        self._arms, self._waist = Chain(chains), Chain([waist])
        hinges = self._arms.length
        self._moment, self._mass = np.zeros((hinges, 3, 2, 1)), np.zeros((hinges, 2, 1))
        for side, chain in enumerate(chains):
            for place, body in enumerate(body for body in chain if body.hinge is not None):
                mass, moment = robot.tree.burden(body.name)
                self._moment[place, :, side, 0] = moment
                self._mass[: place + 1, side] += mass
        self._grip = robot.grip_offset.T[:, :, None]

    def torque(self, arms: Array, waist: Array, gravity: Array, load: Array | None = None) -> Array:
        """Motor torques that hold the arms still, (n, arms) [N·m], in the order of the interaction branch.

        `arms` (n, arms) and `waist` (n, waist joints) positions [rad], measured or referred to; `gravity` (n, 3): its
        direction in the base frame, (0, 0, -1) when upright; `load` (n, 2), or (n, 1) where it is the same on both:
        mass that hangs on each grip point [kg].

        The torque of hinge i is -(a_i × Σ_k m_k (c_k - o_i))·g over the links k from i outward, with its axis a_i and
        origin o_i and the links' centres c_k; the load's part is Jᵀ of its weight.
        """
        count, hinges = len(arms), self._arms.length
        moments = np.empty((3, hinges + 1, 2, count))
        carried = self._mass
        moments[:, hinges] = 0.0
        if load is not None:
            moments[:, hinges] = self._grip * load.T
            carried = carried + load.T
        weights = Weights(self._moment, carried)
        self._arms.carry(arms.reshape(count, 2, hinges).transpose(2, 1, 0), moments, hinges, weights)
        axes = np.zeros((3, 4, 1, count))
        axes[:, :3] = AXES
        self._waist.carry(waist.T[:, None], axes)
        down = np.einsum("xkn,nx->kn", axes[:, :3, 0], GRAVITY * gravity)
        torque: Array = -np.einsum("xjsn,xn->nsj", moments[:, :hinges], down)
        return torque.reshape(count, -1)
