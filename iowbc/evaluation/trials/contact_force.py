"""Horizontal forces between the robot, what it moves, and the partner."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.evaluation.trials.errors import moving_average
from iowbc.evaluation.trials.trace import Trace

MOST = 95.0
"""Percentile of a force that is exceeded only for moments [%]."""


def contact_forces(trace: Trace) -> dict[str, float]:
    """`handle_force_p95`: 95th percentile of the horizontal force of the partner on the object [N]; `hand_force_p95`:
    that of the object on a hand, the greater of the two hands [N]."""
    handle = np.linalg.norm(trace.partner_force[:, :2], axis=1)
    hands = np.linalg.norm(trace.grip_force.reshape(-1, 2, 3)[:, :, :2], axis=2)
    return {
        "handle_force_p95": float(np.percentile(handle, MOST)),
        "hand_force_p95": float(np.percentile(hands, MOST, axis=0).max()),
    }


def push_time(trace: Trace, moving: Mask, *, friction: float, resistance: float, part: float, window: int) -> float:
    """Part of the time in which steps are commanded (T,) for which the hands push as much as asked; NaN without such
    time, or without a crate.

    They push by -Σ f · d, with f the force of the crate on each hand and d the commanded heading. Asked is `part` of
    what friction allows: min(friction · Σ N, resistance), with N the vertical force of the ground on each foot and the
    crate's rolling resistance [N]. Push and N are averaged over `window` control steps, one gait period, since both
    swing with the steps.
    """
    if not (resistance > 0 and moving.any()):
        return np.nan
    away = np.stack([np.cos(trace.heading_reference), np.sin(trace.heading_reference)], axis=1)
    on_hands: Array = trace.grip_force.reshape(-1, 2, 3)[:, :, :2].sum(axis=1)
    pushed = moving_average(-np.vecdot(on_hands, away), window)
    borne = moving_average(trace.foot_load.sum(axis=1), window)
    return float(np.mean((pushed >= part * np.minimum(friction * borne, resistance))[moving]))
