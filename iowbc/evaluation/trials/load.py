"""Who carries the object: the hands, the partner, or thighs and torso."""

import numpy as np

from iowbc.evaluation.trials.trace import Trace

SETTLING = 1.0
"""The first second, in which the weight comes to bear, is left out [s]."""


def load_metrics(trace: Trace, weight: float, least: float) -> dict[str, float]:
    """Shares of a held object's weight [N], means over the trial without its first second; NaN where nothing is held.

    `hand_weight_share`: the hands' vertical force over the weight. `partner_weight_share`: the partner's.
    `weight_in_hands`: the hands' part of what the robot carries at all, links included; NaN where that is less than
    `least` [N], and a touch of the torso would be several times as much.
    """
    begin = round(SETTLING / trace.dt)
    if not weight > 0 or len(trace) <= begin:
        return dict.fromkeys(("hand_weight_share", "partner_weight_share", "weight_in_hands"), np.nan)
    hands = float(np.mean(-trace.grip_force[begin:, [2, 5]].sum(axis=1))) / weight
    partner = float(np.mean(trace.partner_force[begin:, 2])) / weight
    left = 1.0 - partner
    return {
        "hand_weight_share": hands,
        "partner_weight_share": partner,
        "weight_in_hands": hands / left if left * weight > least else np.nan,
    }
