"""State of the task of each environment between two control steps."""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.control.command import COMMAND
from iowbc.task.curriculum import AXES
from iowbc.task.rewards.table import TRACKED

COUNTERS = ("episode", "draws", "steps", "limit", "goal_until", "undisturbed", "walked")
FLAGS = ("walking", "infeasible", "failed", "stepping")
"""Integer and boolean fields; all others but `failed_key` are float64."""
PER_EPISODE_FIELDS = (
    *("action", "earlier_action", "filtered_velocity", "excess_force", "lag", "tracking"),
    *("walked", "commanded", "covered", "heading_error", "total"),
)
"""Fields that are zero at the start of an episode."""
NEVER_DISTURBED = 1_000_000
"""Control steps since a disturbance that has not happened yet."""


@dataclass
class EpisodeState:
    """State of the task, one row an environment; together with the simulation's it is the whole state."""

    episode: Array
    """Episodes begun, (n,) int64; a counter of the random numbers."""
    draws: Array
    """Command goals drawn in the episode, (n,) int64; a counter of the random numbers."""
    steps: Array
    """Control steps made in the episode, (n,) int64."""
    limit: Array
    """Time limit of the episode in control steps, (n,) int64."""
    goal_until: Array
    """Control step at which the next goal is drawn, (n,) int64."""
    level: Array
    """Curriculum levels, (n, axes); see `iowbc.task.curriculum.AXES`."""
    played: Array
    """Effective levels of the episode, (n, axes); see `iowbc.task.curriculum.played_levels`."""
    walking: Array
    """True where the episode commands velocities, (n,) bool."""
    infeasible: Array
    """True where the crate's rolling resistance exceeds the friction of the feet, (n,) bool."""
    failed: Array
    """True where the episode of `failed_key` has not been survived since, (n,) bool."""
    failed_key: Array
    """Key of the last failed episode, (n,) uint64."""
    command: Array
    """C in force, rate-limited and clamped, (n, 11)."""
    goal: Array
    """Goal that the command approaches, (n, 11)."""
    height_rate: Array
    """Rate of change of the commanded height, (n,) [m/s]."""
    phase: Array
    """Gait phase, (n,)."""
    stepping: Array
    """True where the gait clock runs, (n,) bool."""
    feedback: Array
    """Forward offset of left foot, right foot and both from their places in the stride, stretch of both legs [m], and
    turn of both hips [rad], (n, 5)."""
    arms: Array
    """θ_I_ref, (n, 14) [rad]."""
    posture: Array
    """θ_S_ref without the gait prior, until the first step with it, (n, 15) [rad]."""
    support: Array
    """θ_S_ref with the gait prior, (n, 15) [rad]."""
    action: Array
    """a_{t−1}, (n, 15)."""
    earlier_action: Array
    """a_{t−2}, (n, 15)."""
    filtered_velocity: Array
    """Low-passed v_sys in the plane, heading frame [m/s], and yaw rate [rad/s], (n, 3)."""
    excess_force: Array
    """Low-passed horizontal force on the hands beyond what the transport needs, heading frame, (n, 2) [N]."""
    heading_offset: Array
    """Measured less true heading at the start of the episode, (n,) [rad]: the origin of the measured heading."""
    heading_reference: Array
    """Heading at the start plus the integrated commanded yaw rate, (n,) [rad]."""
    object_place: Array
    """Offset of a held object from the middle of the wrist targets at the start, heading frame, (n, 3) [m]."""
    lag: Array
    """Leaky integral of the speed lacking along the command, of robot and object, (n,) [m]."""
    undisturbed: Array
    """Control steps since an impulse or a push last acted, (n,) int64."""
    tracking: Array
    """Sums of the scores of height and torso pitch over the episode, (n, tracked)."""
    walked: Array
    """Control steps of the episode with a commanded planar velocity or yaw rate, (n,) int64."""
    commanded: Array
    """Displacement that the episode commanded, (n,) [m]."""
    covered: Array
    """Displacement along the command, at no more than the commanded speed, (n,) [m]."""
    heading_error: Array
    """Sum of the absolute heading errors of the episode, (n,) [rad]."""
    total: Array
    """Sum of the rewards of the episode, (n,)."""

    @classmethod
    def blank(cls, n: int, arms: int, support: int) -> Self:
        kinds: dict[str, Any] = dict.fromkeys(COUNTERS, np.int64) | dict.fromkeys(FLAGS, np.bool_)
        kinds["failed_key"] = np.uint64
        widths = {"tracking": len(TRACKED), "feedback": 5, "filtered_velocity": 3, "excess_force": 2, "object_place": 3}
        widths |= dict.fromkeys(("level", "played"), len(AXES)) | dict.fromkeys(("command", "goal"), len(COMMAND))
        widths |= {"arms": arms} | dict.fromkeys(("posture", "support", "action", "earlier_action"), support)
        shapes = {field.name: (n, widths[field.name]) if field.name in widths else (n,) for field in fields(cls)}
        return cls(**{name: np.zeros(shape, kinds.get(name, np.float64)) for name, shape in shapes.items()})

    def clear(self, which: Indices) -> None:
        """Resets the fields of the last episode in some environments, (k,)."""
        for name in PER_EPISODE_FIELDS:
            getattr(self, name)[which] = 0
        self.undisturbed[which] = NEVER_DISTURBED
