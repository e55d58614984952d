"""Signals and counters that an environment batch writes for its parent in each step."""

SIGNALS = {
    "system_velocity": 3,
    "commanded_velocity": 3,
    **dict.fromkeys(("heading", "heading_reference", "torso_pitch", "torso_pitch_command"), 1),
    **dict.fromkeys(("pelvis_height", "height_command", "saturation"), 1),
    "grip_force": 6,
    "partner_force": 3,
    **dict.fromkeys(("slipped", "fallen", "dropped", "lagging", "diverged"), 1),
    "base_position": 3,
    "power": 1,
    "phase": 1,
    "foot_contact": 2,
    "level": 4,
    "time": 1,
}
"""Signals with their sizes: values of the step just made, before an automatic reset. v_sys and the commanded velocity
(v_x, v_y, ω) in the heading frame [m/s, rad/s], heading and its reference [rad], torso pitch [rad], height that H
commands [m], saturated fraction of all joints, forces of left and right grip and of the partner in the world frame
[N], flags, base position in the world frame [m], power [W], gait phase in [0, 1), feet in contact, curriculum
levels, time in the episode [s]."""

TRIAL_SIGNALS = {
    "torso_position": 3,
    "object_position": 3,
    "foot_position": 6,
    "foot_slide": 2,
    "foot_margin": 2,
    "foot_sink": 2,
    "foot_peak": 2,
    "foot_load": 2,
    "foot_shear": 2,
    "link_object_force": 1,
    "external_force": 3,
    "handle_displacement": 3,
    "partner_velocity": 3,
}
"""Further signals of planned episodes, world frame: a point in the torso, the object (zero without one), left and right
sole centre [m]; of each foot the speed at its centre of pressure [m/s], that centre's distance from the edge of the
sole [m], the downward speed of its lowest corner [m/s], the ground's largest force in any physics step, its vertical
and its horizontal force in the last one [N]; the size of the net force of thighs, torso and arms on the object, the
force of partner, impulses and pulls on it [N]; the displacement of its far handle in the step [m], and the
velocity that the partner intends for it [m/s]."""

REASONS = ("fallen", "dropped", "lagging", "time_limit", "diverged")
"""Reasons for the end of an episode."""
CAUSES = ("walking", "standing", "disturbed")
"""Situations in which a robot falls: walking, standing, or just after a disturbance."""
KINDS = ("standing", "walking")
"""Kinds of command."""
ERRORS = ("velocity", "heading", "height", "pitch")
"""Tracking errors: the norm of v_sys - v_coll in the plane, filtered [m/s], heading [rad], height [m], pitch [rad]."""
COUNTERS = (
    *("steps", "tracking", "episodes", "length", "return", *REASONS),
    *(f"fell/{cause}" for cause in CAUSES),
    *("pushes", "infeasible"),
    *(f"{kind}/{name}" for kind in KINDS for name in ("steps", *ERRORS)),
)
"""Columns of the statistics: sums since they were last read. Length in steps, errors absolute."""


def trial_signals(joints: int, support: int) -> dict[str, int]:
    """Signals only of planned episodes, with sizes. In addition to `TRIAL_SIGNALS`: torque [N·m] of all joints, and
    whether it is at its limit; offset that the action adds to the references of the support joints [rad]."""
    return TRIAL_SIGNALS | {"joint_torque": joints, "joint_saturation": joints, "action": support}
