"""Made-up trials, whose figures are known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from iowbc.evaluation.report.aggregate import ALL_ERRORS, OVER_ALL_TRIALS, STILL
from iowbc.evaluation.trials.rollout import Outcome
from iowbc.recipe.recipe import Recipe
from iowbc.task.episodes import CommandScript, CommandSegment
from iowbc.task.record.signals import Trace

DT = 0.02
JOINTS = {"hip": 80.0, "knee": 100.0}
ROBOT: Any = SimpleNamespace(
    joints=tuple(JOINTS), effort=np.array([*JOINTS.values()]), linkages=np.zeros((0, 2), np.intp)
)
"""All of a robot that its measurement needs."""
RECIPE = Recipe.model_validate(
    {"name": "x", "task": {"references": {"gait": {"frequency": 1.25}}, "commands": {"nominal_height": 0.75}}}
)
GAIT_STEPS = round(RECIPE.task.control_frequency / RECIPE.task.references.gait.frequency)
COSTS = (
    *("E_v_raw", "E_v_raw_moving", "E_v_partner", "distance", "saturation", "saturation_peak", "slip_share"),
    *("partner_force_peak", "grip_force_peak", "link_object_force", "energy"),
    *("foot_slip", "foot_slip_peak", "foot_slip_per_metre", "foot_drift", "foot_drift_per_metre"),
    *("swing_clearance_left", "swing_clearance_right", "hand_weight_share", "partner_weight_share", "weight_in_hands"),
    *("torso_jerk", "object_jerk", "touchdown_speed", "touchdown_speed_peak", "foot_force_peak"),
    *("pressure_margin", "pressure_margin_low", "friction_use", "friction_use_high", "action_second_difference"),
    *("push_force", "push_force_share", "impedance_real", "impedance_imag"),
)
"""Metrics beside the errors that are averaged over the surviving trials."""


def script(seconds: float = 8.0, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> CommandScript:
    """One segment at H 0.75 m, upright."""
    return CommandScript((CommandSegment(seconds, (*velocity, 0.75, 0.0, *[0.0] * 6)),))


def outcome(
    signals: Trace,
    mass: float = 0.0,
    friction: float = 1.0,
    rolling: float = 0.0,
    strength: float = 1.0,
    robot: Any = ROBOT,
) -> Outcome:
    """A trial that was survived, with the drawn mass [kg], friction of the ground, rolling resistance [N] and strength
    of the motors."""
    drawn = {"object_mass": mass, "ground_friction": friction, "rolling_resistance": rolling, "partner_share": 0.0}
    seconds, values = DT * len(signals), {name: np.array([value]) for name, value in drawn.items()}
    values |= {"motor_strength": np.full(len(robot.joints), strength)}
    values |= {"linkage_effort": np.full(len(robot.linkages), 50.0)}
    return Outcome(signals, seconds, "finished", values)


def trace(steps: int = 400) -> Trace:
    """A robot that stands as it is told, heading along x, with nothing in its hands."""
    zeros, vectors = np.zeros(steps), np.zeros((steps, 3))
    return Trace(
        dt=DT,
        system_velocity=vectors,
        commanded_velocity=vectors,
        heading=zeros,
        heading_reference=zeros,
        torso_pitch=zeros,
        torso_pitch_command=zeros,
        pelvis_height=np.full(steps, 0.75),
        height_command=np.full(steps, 0.75),
        saturation=zeros,
        slipped=zeros,
        partner_force=vectors,
        link_object_force=zeros,
        grip_force=np.zeros((steps, 6)),
        external_force=vectors,
        handle_displacement=vectors,
        partner_velocity=vectors,
        power=np.full(steps, 100.0),
        base_position=vectors,
        torso_position=vectors,
        object_position=vectors,
        foot_position=np.zeros((steps, 6)),
        foot_slide=np.zeros((steps, 2)),
        foot_margin=np.full((steps, 2), 0.02),
        foot_sink=np.zeros((steps, 2)),
        foot_peak=np.full((steps, 2), 160.0),
        foot_load=np.full((steps, 2), 160.0),
        foot_shear=np.zeros((steps, 2)),
        foot_contact=np.ones((steps, 2)),
        action=np.zeros((steps, 2)),
        joint_torque=np.zeros((steps, len(JOINTS))),
        joint_saturation=np.zeros((steps, len(JOINTS))),
    )


def trials_of(
    variant: str,
    suite: str,
    survivors: dict[float, int],
    case: str = "",
    *,
    error: float = 0.1,
    kind: str = "",
    impulse: float = 0.0,
) -> pd.DataFrame:
    """Five trials a mass, of which the given number survived and succeeded, with errors that grow by 0.1 a trial."""
    rows = [
        {
            "variant": variant,
            "kind": kind or suite.split(" ")[0],
            "suite": suite,
            "case": case or suite,
            "mass": mass,
            "impulse": impulse,
            "trial": trial,
            "survived": trial < count,
            "succeeded": trial < count,
            "carried": trial < count,
            "kept": trial < count,
            "object_beside": 0.1 if suite.startswith("push") else np.nan,
            **dict.fromkeys(ALL_ERRORS, error + 0.1 * trial),
            **dict.fromkeys(STILL, 0.25),
            **dict.fromkeys((*COSTS, *OVER_ALL_TRIALS), 1.0),
            "transport_robot": 0.9,
            "transport_object": 0.8,
            "commanded_distance": 4.0,
            "partner_share": 0.5 if "partner" in suite else 0.0,
            "rolling_resistance": 0.06,
            "drawn_rolling_resistance": 20.0 if suite.startswith("push") else 0.0,
            "height": "pelvis",
            "gait_period": 0.8,
            "peak_torque/hip": 20.0,
            "peak_torque/knee": 40.0,
            "saturated/hip": 0.0,
            "saturated/knee": 0.1,
            "torque_rms/hip": 0.1,
            "torque_rms/knee": 0.3,
        }
        for mass, count in survivors.items()
        for trial in range(5)
    ]
    return pd.DataFrame(rows)
