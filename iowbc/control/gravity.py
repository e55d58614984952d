"""Torques with which the arms carry their own weight, and a load in the hands: a feed-forward for their motors."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Constants, namespace
from iowbc.control.arms import arm_chains, by_arm, by_row
from iowbc.control.chain import Chain, Frame, combined, crossed, entries, rotated, rotated_back
from iowbc.robot.description import GRAVITY, Robot


class ArmGravity(Constants):
    """Static torques of both arms, many robots at once. Holds constants only."""

    def __init__(self, robot: Robot) -> None:
        chains, waist = arm_chains(robot)
        self._arms, self._waist = Chain(chains), Chain([waist])
        hinges = self._arms.length
        moment, mass = np.zeros((hinges, 3, 2)), np.zeros((hinges, 2, 1))
        for side, chain in enumerate(chains):
            for place, body in enumerate(body for body in chain if body.hinge is not None):
                mass[place, side], moment[place, :, side] = robot.tree.burden(body.name)
        self._mass, self._moment = mass, tuple(map(entries, moment))
        self._outward = np.cumsum(mass[::-1], axis=0)[::-1].copy()
        self._grip = robot.grip_offset.T[:, :, None]

    def torque(
        self,
        arms: Array,
        waist: Array,
        gravity: Array,
        load: Array | None = None,
        frames: Sequence[Frame] | None = None,
    ) -> Array:
        """Motor torques that hold the arms still, (n, arms) [N·m], in the order of the interaction branch.

        `arms` (n, arms) and `waist` (n, waist joints) positions [rad], measured or referred to; `gravity` (n, 3): its
        direction in the base frame, (0, 0, -1) when upright; `load` (n, 2), or (n, 1) where it is the same on both:
        mass that hangs on each grip point [kg]; `frames` of `arms`, where they are known.

        The torque of hinge i is -(a_i × Σ_k m_k (c_k - o_i))·g over the links k from i outward, with its axis a_i and
        origin o_i and the links' centres c_k; the load's part is Jᵀ of its weight.
        """
        xp, frames = namespace(arms), frames or self._arms.frames(by_arm(arms))
        torso = self._waist.frames(waist.T[:, None])[-1].rotation
        down = GRAVITY * rotated_back(torso, gravity.T[:, None])
        moments, mass = [0.0 * frames[-1].origin], self._outward
        if load is not None:
            mass = mass + load.T
            moments = [load.T * (frames[-1].origin + rotated(frames[-1].rotation, self._grip))]
        for hinge in reversed(range(len(frames))):
            own = self._mass[hinge] * frames[hinge].origin + combined(frames[hinge].rotation, self._moment[hinge])
            moments.append(moments[-1] + own)
        axes, origins = (xp.stack([getattr(frame, name) for frame in frames], 1) for name in ("axis", "origin"))
        lever = xp.stack(moments[:0:-1], 1) - mass * origins
        return by_row(-(crossed(axes, lever) * down[:, None]).sum(0))
