"""Interaction of robot, object and partner: shares of the weight, forces, work, mechanical impedance to a pull."""

import numpy as np

from iowbc.arrays import Array
from iowbc.evaluation.trials.errors import moving_average
from iowbc.evaluation.trials.feet import HIGH
from iowbc.robot.rotations import turned
from iowbc.task.episodes import PlannedPull
from iowbc.task.record.signals import Trace

SETTLING = 1.0
"""Initial time excluded while the load is taken up [s]."""


def load_metrics(trace: Trace, weight: float, judged: bool = True) -> dict[str, float]:
    """Fractions of a held object's `weight` [N], means over the trial without its first second; NaN if nothing is held.

    `hand_weight_share`: the hands' vertical force over the weight. `partner_weight_share`: the partner's.
    `weight_in_hands`: the hands' part of the load on the robot, which is the weight less all external vertical forces;
    the rest is borne by contacts of other links, and more than 1 means that these press the object down. NaN unless
    `judged`, for loads so small that a touch of the torso would dominate.
    """
    begin = round(SETTLING / trace.dt)
    if not weight > 0 or len(trace) <= begin:
        return dict.fromkeys(("hand_weight_share", "partner_weight_share", "weight_in_hands"), np.nan)
    hands = float(np.mean(-trace.grip_force[begin:, [2, 5]].sum(axis=1))) / weight
    partner = float(np.mean(trace.partner_force[begin:, 2])) / weight
    left = 1.0 - float(np.mean(trace.external_force[begin:, 2])) / weight
    return {
        "hand_weight_share": hands,
        "partner_weight_share": partner,
        "weight_in_hands": hands / left if judged and left > 0.0 else np.nan,
    }


def interaction_metrics(trace: Trace, window: int) -> dict[str, float]:
    """Horizontal forces at hands and handle, work on the partner, and velocity error to the partner.

    window: control steps of a gait period.

    `hand_force_mean`, `_p95`, `_peak`: horizontal force between object and a hand, of the hand with more [N], in
    compliant grasps without the pressure of the palms; NaN without an object. `handle_force_mean`, `_p95`, `_peak`: of
    the partner at the far handle [N]; `partner_work`: horizontal work done on the partner [J]; `E_v_partner`: mean
    planar deviation of the handle's velocity, averaged over a gait period, from the one that the partner intends [m/s];
    NaN without a partner.
    """
    none = np.full(1, np.nan)
    at_hands = np.linalg.norm(hand_forces(trace), axis=-1) if np.any(trace.object_position) else none
    helped = np.any(trace.partner_force)
    handle = trace.partner_force[:, :2]
    way = trace.handle_displacement[:, :2]
    away = moving_average(way / trace.dt, window) - trace.partner_velocity[:, :2]
    return {
        **_spread("hand_force", at_hands),
        **_spread("handle_force", np.linalg.norm(handle, axis=1) if helped else none),
        "partner_work": -float(np.sum(handle * way)) if helped else np.nan,
        "E_v_partner": float(np.mean(np.linalg.norm(away, axis=1))) if helped else np.nan,
    }


def push_metrics(
    trace: Trace, directions: Array, window: int, friction: float, resistance: float, part: float
) -> dict[str, float]:
    """Force of the hands along the commanded motion; NaN without commanded motion or without an object.

    directions: of the commanded motion in the world frame, zero in standing, (T or more, 2); window: control steps of a
    gait period; friction: coefficient between feet and ground; resistance: of the rolling object [N]; part: fraction of
    the largest possible force that counts as pushing.

    `push_force`: mean horizontal force of the hands on the object along the command [N]. `push_force_share`: fraction
    of the time in which it is at least `part` of the largest possible force, the smaller of friction times the vertical
    ground force and the object's resistance; forces averaged over a gait period.
    """
    directions = directions[: len(trace)]
    commanded = directions.any(axis=1)
    if not (commanded.any() and np.any(trace.object_position)):
        return {"push_force": np.nan, "push_force_share": np.nan}
    along = -np.vecdot(hand_forces(trace).sum(axis=1), directions)
    most = np.minimum(friction * moving_average(trace.foot_load.sum(axis=1), window), resistance)
    enough = moving_average(along, window) >= part * most
    return {"push_force": float(np.mean(along[commanded])), "push_force_share": float(np.mean(enough[commanded]))}


def hand_forces(trace: Trace) -> Array:
    """Horizontal force of the object on each hand, (T, 2, 2) [N]."""
    return trace.grip_force.reshape(-1, 2, 3)[..., :2]


def _spread(name: str, sizes: Array) -> dict[str, float]:
    """Mean, 95th percentile and peak of a force magnitude (T,); for several (T, k), the largest of each."""
    return {
        f"{name}_mean": float(np.mean(sizes, axis=0).max()),
        f"{name}_p95": float(np.percentile(sizes, HIGH, axis=0).max()),
        f"{name}_peak": float(np.max(sizes)),
    }


def impedance(force: Array, position: Array, frequency: float, dt: float) -> complex:
    """Z = F / v at a frequency [Hz], complex [N·s/m]: i·ω·m of a mass, c of a damper, k / (i·ω) of a spring.

    force: along the pull, held over each control period at its value in the middle; position: at the end of the
    period; (T,) [N, m]. The amplitudes are a least-squares fit of sine and cosine together with a quadratic drift, for
    the robot's own motion. NaN without any motion.
    """
    time = dt * np.arange(len(force))
    angle = 2.0 * np.pi * frequency * time
    scaled = time / time[-1]
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(time), scaled, np.square(scaled)], axis=1)
    fitted = np.linalg.lstsq(basis, np.stack([force, position], axis=1), rcond=None)[0]
    pulled, moved = (fitted[0] - 1j * fitted[1]) * np.array([1.0, np.exp(-1j * np.pi * frequency * dt)])
    return complex(pulled / (2j * np.pi * frequency * moved)) if moved else complex(np.nan, np.nan)


def impedance_metrics(trace: Trace, pull: PlannedPull | None) -> dict[str, float]:
    """Impedance of the object's centre to a pull after its first period: `impedance_real`, `_imag`, `_magnitude`
    [N·s/m] and `_phase` [rad], from -π/2 (spring) over 0 (damper) to π/2 (mass). NaN without a pull, or if the trial
    ended before its end."""
    value = complex(np.nan, np.nan)
    if pull is not None:
        period = 1.0 / pull.frequency
        first, last = (round((pull.begin + time) / trace.dt) for time in (period, pull.duration))
        if last - first >= round(period / trace.dt) and len(trace) >= last:
            (along,) = turned(np.array([pull.force]), trace.heading_reference[[first]])
            along /= np.linalg.norm(along)
            force, position = trace.external_force[first:last, :2], trace.object_position[first:last, :2]
            value = impedance(force @ along, position @ along, pull.frequency, trace.dt)
    return {
        "impedance_real": value.real,
        "impedance_imag": value.imag,
        "impedance_magnitude": abs(value),
        "impedance_phase": float(np.angle(value)),
    }


def apparent(frequency: Array, value: Array) -> dict[str, float]:
    """Equivalent mass-spring-damper, m ẍ + c ẋ + k x = F, of the robot with its object: `stiffness` k [N/m], `damping`
    c [N·s/m], `mass_apparent` m [kg].

    Fitted to impedances `value` (k,), complex, at frequencies (k,) [Hz], by least squares in Z = c + i (ω m - k / ω).
    With fewer than two frequencies, mass and stiffness are undetermined: NaN.
    """
    angular, mass, stiffness = 2.0 * np.pi * frequency, np.nan, np.nan
    if len(np.unique(frequency)) >= 2:
        mass, stiffness = np.linalg.lstsq(np.stack([angular, -1.0 / angular], axis=1), value.imag, rcond=None)[0]
    return {"stiffness": float(stiffness), "damping": float(np.mean(value.real)), "mass_apparent": float(mass)}
