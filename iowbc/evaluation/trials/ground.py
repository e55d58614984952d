"""How the feet meet the ground: impacts, and how near the contact is to tipping and to slipping."""

import numpy as np

from iowbc.evaluation.trials.feet import runs
from iowbc.evaluation.trials.trace import Trace

SHORTEST_SWING = 0.1
"""A foot touches down after it was in the air for at least this long; less is chatter of the contact [s]."""
LOW, HIGH = 5.0, 95.0
"""Percentiles of the worse end of what varies within a trial."""


def ground_metrics(trace: Trace, load: float, friction: float) -> dict[str, float]:
    """Impacts, and margins of loaded feet.

    load: vertical force from which a foot counts as loaded [N]; friction: coefficient between feet and ground.

    `touchdown_speed`, `touchdown_speed_peak`: mean and largest downward speed of the lowest corner of a sole in the
    last control period before it touches the ground [m/s]; NaN without a touchdown. `foot_force_peak`: largest force of
    the ground on a foot in any physics step [N]. `pressure_margin`: distance of the centre of pressure from the edge of
    the sole, mean weighted by the load, and `pressure_margin_low`, its 5th percentile [m]. `friction_use`: horizontal
    force as a part of what friction allows at the foot's load, mean weighted by the load, and `friction_use_high`, its
    95th percentile. NaN where no foot was loaded.
    """
    shortest = round(SHORTEST_SWING / trace.dt)
    speeds = [
        max(float(trace.foot_sink[swing.stop - 1, foot]), 0.0)
        for foot in range(2)
        for swing in runs(trace.foot_contact[:, foot] == 0)
        if swing.stop - swing.start >= shortest and swing.stop < len(trace)
    ]
    loaded = trace.foot_load >= load
    borne, margin = trace.foot_load[loaded], trace.foot_margin[loaded]
    use = trace.foot_shear[loaded] / (friction * borne)
    return {
        "touchdown_speed": float(np.mean(speeds)) if speeds else np.nan,
        "touchdown_speed_peak": max(speeds, default=np.nan),
        "foot_force_peak": float(np.max(trace.foot_peak)),
        "pressure_margin": float(np.average(margin, weights=borne)) if len(borne) else np.nan,
        "pressure_margin_low": float(np.percentile(margin, LOW)) if len(borne) else np.nan,
        "friction_use": float(np.average(use, weights=borne)) if len(borne) else np.nan,
        "friction_use_high": float(np.percentile(use, HIGH)) if len(borne) else np.nan,
    }
