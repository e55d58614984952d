"""Foot metrics: slip, drift, clearance, impacts, and margins to tipping and slipping."""

import numpy as np

from iowbc.arrays import Mask
from iowbc.task.record.signals import Trace

SHORTEST_WALK = 0.5
"""Minimum walked distance for slip per metre [m]."""
SHORTEST_SWING = 0.1
"""Minimum time of a swing; shorter intervals in the air are contact chatter [s]."""
LOW, HIGH = 5.0, 95.0
"""Percentiles for the worse end of a quantity within a trial."""


def foot_metrics(trace: Trace, load: float, walked: float) -> dict[str, float]:
    """Slip of loaded feet and clearance of swinging feet.

    load: vertical force from which a foot counts as loaded [N]; walked: length of the base's path [m].

    `foot_slip`: path length of sliding at the centres of pressure of loaded soles, both feet [m]; rolling over an edge
    of the foot does not count. `foot_slip_peak`: largest slip in one stance [m]. `foot_drift`: displacement of a sole
    during a stance, summed over the stances of both feet [m]. `_per_metre`: either per metre walked; NaN below
    `SHORTEST_WALK`. `swing_clearance_left`, `_right`: maximum sole height, mean over swings [m]; zero without a swing.
    `swings`: their number, both feet.
    """
    loaded = trace.foot_load >= load
    slid = trace.foot_slide * loaded * trace.dt
    position = trace.foot_position.reshape(-1, 2, 3)
    stances = [(foot, stance) for foot in range(2) for stance in runs(loaded[:, foot])]
    slips = [float(slid[stance, foot].sum()) for foot, stance in stances]
    drifts = [position[stance.stop - 1, foot, :2] - position[stance.start, foot, :2] for foot, stance in stances]
    slip, drift = sum(slips), float(sum(np.hypot(*moved) for moved in drifts))
    swings = [[position[swing, foot, 2].max() for swing in _swings(trace, foot)] for foot in range(2)]
    return {
        "foot_slip": slip,
        "foot_slip_peak": max(slips, default=0.0),
        "foot_slip_per_metre": slip / walked if walked >= SHORTEST_WALK else np.nan,
        "foot_drift": drift,
        "foot_drift_per_metre": drift / walked if walked >= SHORTEST_WALK else np.nan,
        "swings": float(sum(map(len, swings))),
        **{
            f"swing_clearance_{side}": float(np.mean(highest)) if highest else 0.0
            for side, highest in zip(("left", "right"), swings, strict=True)
        },
    }


def ground_metrics(trace: Trace, load: float, friction: float) -> dict[str, float]:
    """Impacts, and margins of loaded feet.

    load: vertical force from which a foot counts as loaded [N]; friction: coefficient between feet and ground.

    `touchdown_speed`, `touchdown_speed_peak`: mean and largest downward speed of the lowest corner of a sole in the
    last control period before it touches the ground [m/s]; NaN without a touchdown. `foot_force_peak`: largest force of
    the ground on a foot in any physics step [N]. `pressure_margin`: distance of the centre of pressure from the edge of
    the sole, mean weighted by the load, and `pressure_margin_low`, its 5th percentile [m]. `friction_use`: horizontal
    force as a fraction of the friction limit at the foot's load, mean weighted by the load, and `friction_use_high`,
    its 95th percentile. NaN if no foot was loaded.
    """
    speeds = [
        max(float(trace.foot_sink[swing.stop - 1, foot]), 0.0)
        for foot in range(2)
        for swing in _swings(trace, foot)
        if swing.stop < len(trace)
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


def _swings(trace: Trace, foot: int) -> list[slice]:
    """Swings of a foot, in order; the last may end with the trial."""
    shortest = round(SHORTEST_SWING / trace.dt)
    return [run for run in runs(trace.foot_contact[:, foot] == 0) if run.stop - run.start >= shortest]


def runs(mask: Mask) -> list[slice]:
    """Intervals in which a mask (T,) is true, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [slice(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
