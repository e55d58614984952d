"""Torques with which the arms carry their own weight, and a load in the hands: a feed-forward for their motors."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.arms import Reach, arm_chains, reach_of
from iowbc.control.chain import Chain, Weights
from iowbc.robot.description import GRAVITY, Robot

MASSES, GRIPS = slice(0, 2), slice(2, 4)
"""Chains that carry the masses of both arms, and those that carry their grip points."""
AXES = np.eye(3)[:, :, None, None]
"""The unit vectors side by side, as `Chain.carry` takes them."""


class ArmGravity:
    """Static torques of both arms, many robots at once. Holds constants only."""

    def __init__(self, robot: Robot) -> None:
        chains, waist = arm_chains(robot)
        self._arms, self._waist = Chain([*chains, *chains]), Chain([waist])
        """Both arms with their masses, and both once more with a unit mass at the grip point alone, for the reach."""
        hinges = self._arms.length
        self._moment, self._mass = np.zeros((hinges, 3, 4, 1)), np.zeros((hinges, 4, 1))
        self._mass[:, GRIPS] = 1.0
        for side, chain in enumerate(chains):
            for place, body in enumerate(body for body in chain if body.hinge is not None):
                mass, moment = robot.tree.burden(body.name)
                self._moment[place, :, side, 0] = moment
                self._mass[: place + 1, side] += mass
        self._grip = robot.grip_offset.T[:, :, None]

    def torque(self, arms: Array, waist: Array, gravity: Array, load: Array | None = None) -> Array:
        """As `torque_and_reach`, without the reach."""
        return self.torque_and_reach(arms, waist, gravity, load)[0]

    def torque_and_reach(
        self, arms: Array, waist: Array, gravity: Array, load: Array | None = None
    ) -> tuple[Array, Reach]:
        """Motor torques that hold the arms still, (n, arms) [N·m], in the order of the interaction branch, and the
        reach of the arms, which costs little beside them.

        `arms` (n, arms) and `waist` (n, waist joints) positions [rad], measured or referred to; `gravity` (n, 3): its
        direction in the base frame, (0, 0, -1) when upright; `load` (n, 2), or (n, 1) where it is the same on both:
        mass that hangs on each grip point [kg].

        The torque of hinge i is -(a_i × Σ_k m_k (c_k - o_i))·g over the links k from i outward, with its axis a_i and
        origin o_i and the links' centres c_k; the load's part is Jᵀ of its weight.
        """
        count, hinges = len(arms), self._arms.length
        moments = np.empty((3, hinges + 1, 4, count))
        moments[:, hinges, MASSES] = 0.0
        moments[:, hinges, GRIPS] = self._grip
        carried = self._mass
        if load is not None:
            moments[:, hinges, MASSES] = self._grip * load.T
            carried = np.repeat(self._mass, count, axis=2)
            carried[:, MASSES] += load.T
        angle = np.empty((hinges, 2, 2, count))
        angle[...] = arms.reshape(count, 2, hinges).transpose(2, 1, 0)[:, None]
        self._arms.carry(angle.reshape(hinges, 4, count), moments, hinges, Weights(self._moment, carried))
        axes = np.zeros((3, 4, 1, count))
        axes[:, :3] = AXES
        self._waist.carry(waist.T[:, None], axes)
        down = np.einsum("xkn,nx->kn", axes[:, :3, 0], GRAVITY * gravity)
        torque: Array = -np.einsum("xjsn,xn->nsj", moments[:, :hinges, MASSES], down)
        return torque.reshape(count, -1), reach_of(moments[:, :, GRIPS])
