"""Torques with which the arms carry their own weight, and a load in the hands: a feed-forward for their motors."""

import numpy as np

from iowbc.arrays import Array, Constants, namespace, stacked
from iowbc.control.arms import arm_chains, by_arm, by_row
from iowbc.control.chain import Chain, Frames, crossed, rotated
from iowbc.robot.description import GRAVITY, Robot


class ArmGravity(Constants):
    """Static torques of both arms, many robots at once. Holds constants only."""

    def __init__(self, robot: Robot) -> None:
        chains, waist = arm_chains(robot)
        self._arms, self._waist = Chain(chains), Chain([waist])
        hinges = self._arms.length
        moment, mass = np.zeros((hinges, 3, 2, 1)), np.zeros((hinges, 1, 2, 1))
        for side, chain in enumerate(chains):
            for place, body in enumerate(body for body in chain if body.hinge is not None):
                mass[place, :, side], moment[place, :, side, 0] = robot.tree.rigid_mass(body.name)
        self._mass, self._moment = mass, moment
        self._outward = np.cumsum(mass[::-1], axis=0)[::-1].copy()
        self._grip = robot.grip_offset.T[:, :, None]

    def torque(
        self, arms: Array, waist: Array, gravity: Array, load: Array | None = None, frames: Frames | None = None
    ) -> Array:
        """Motor torques that hold the arms still, (n, arms) [N·m], in the order of the interaction branch.

        `arms` (n, arms) and `waist` (n, waist joints) positions [rad], measured or reference; `gravity` (n, 3): its
        direction in the base frame, (0, 0, -1) when upright; `load` (n, 2), or (n, 1) where it is the same on both:
        mass that hangs on each grip point [kg]; `frames` of `arms`, where they are known.

        The torque of hinge i is -(a_i × Σ_k m_k (c_k - o_i))·g over the links k from i outward, with its axis a_i and
        origin o_i and the links' centres c_k; the load's part is Jᵀ of its weight.
        """
        xp, frames = namespace(arms), frames or self._arms.frames(by_arm(arms))
        down = GRAVITY * self._waist.inward(waist.T[:, None], gravity.T[:, None], directions=True)
        own = self._mass * frames.origin + rotated(frames.rotation, self._moment)
        mass, moments = self._outward, [own[-1]]
        if load is not None:
            mass = mass + load.T
            moments = [own[-1] + load.T * frames.end(self._grip)]
        for hinge in reversed(range(len(own) - 1)):
            moments.append(moments[-1] + own[hinge])
        lever = stacked(moments[::-1]) - mass * frames.origin
        torque = (crossed(xp.swapaxes(frames.axis, 0, 1), xp.swapaxes(lever, 0, 1)) * down[:, None]).sum(0)
        return by_row(-torque)
