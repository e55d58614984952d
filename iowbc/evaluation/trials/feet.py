"""What the feet do: loaded ones should stay, swinging ones should clear the ground."""

import numpy as np

from iowbc.arrays import Mask
from iowbc.evaluation.trials.trace import Trace

SHORTEST_WALK = 0.5
"""Slip a metre is told where at least this was walked [m]."""


def foot_metrics(trace: Trace, load: float, walked: float) -> dict[str, float]:
    """Slip of loaded feet and clearance of swinging ones.

    load: vertical force from which a foot counts as loaded [N]; walked: length of the base's path [m].

    `foot_slip`: distance that sole centres slide while loaded, both feet [m]; rolling over an edge of the foot counts,
    too. `foot_slip_peak`: the largest in one stance [m]. `foot_slip_per_metre`: a metre walked; NaN where hardly any
    was. `swing_clearance_left`, `_right`: mean over the swings of the highest the sole came [m]; zero without a swing.
    """
    speed = np.linalg.norm(trace.foot_velocity.reshape(-1, 2, 3)[:, :, :2], axis=2)
    loaded = trace.foot_load >= load
    slid = speed * loaded * trace.dt
    total = float(slid.sum())
    stances = [slid[run, foot].sum() for foot in range(2) for run in runs(loaded[:, foot])]
    height = trace.foot_position.reshape(-1, 2, 3)[:, :, 2]
    swings = [[height[run, foot].max() for run in runs(trace.foot_contact[:, foot] == 0)] for foot in range(2)]
    return {
        "foot_slip": total,
        "foot_slip_peak": float(max(stances, default=0.0)),
        "foot_slip_per_metre": total / walked if walked >= SHORTEST_WALK else np.nan,
        "swings": float(sum(map(len, swings))),
        **{
            f"swing_clearance_{side}": float(np.mean(highest)) if highest else 0.0
            for side, highest in zip(("left", "right"), swings, strict=True)
        },
    }


def runs(mask: Mask) -> list[slice]:
    """The stretches in which a mask (T,) is true, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [slice(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
