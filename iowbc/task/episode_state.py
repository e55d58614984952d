"""State of the task of each environment between two control steps."""

import numpy as np

from iowbc.arrays import Indices
from iowbc.control.command import COMMAND
from iowbc.control.references import FEEDBACK_SIZE
from iowbc.task.curriculum import AXES
from iowbc.task.rewards.table import TRACKED

PER_EPISODE_FIELDS = (
    *("action", "earlier_action", "filtered_velocity", "excess_force", "tracking"),
    *("walked", "commanded", "covered", "heading_error", "total"),
)
"""Fields that are zero at the start of an episode."""
PER_ENVIRONMENT_FIELDS = ("episode", "level", "failed", "failed_key")
"""Fields that outlast an episode."""
NEVER_DISTURBED = 1_000_000
"""Control steps since a disturbance that has not happened yet."""


class EpisodeState:
    """State of the task, one row an environment; together with the simulation's it is the whole state."""

    def __init__(self, n: int, arms: int, support: int) -> None:
        """`arms`, `support`: numbers of arm and of support joints."""
        self.episode = np.zeros(n, np.int64)
        """Episodes begun, (n,); a counter of the random numbers."""
        self.draws = np.zeros(n, np.int64)
        """Command goals drawn in the episode, (n,); a counter of the random numbers."""
        self.steps = np.zeros(n, np.int64)
        """Control steps made in the episode, (n,)."""
        self.limit = np.zeros(n, np.int64)
        """Time limit of the episode in control steps, (n,)."""
        self.goal_until = np.zeros(n, np.int64)
        """Control step at which the next goal is drawn, (n,)."""
        self.level = np.zeros((n, len(AXES)))
        """Curriculum levels, (n, axes); see `iowbc.task.curriculum.AXES`."""
        self.played = np.zeros((n, len(AXES)))
        """Effective levels of the episode, (n, axes); see `iowbc.task.curriculum.played_levels`."""
        self.walking = np.zeros(n, np.bool_)
        """True where the episode commands velocities, (n,)."""
        self.infeasible = np.zeros(n, np.bool_)
        """True where the crate's rolling resistance exceeds the friction of the feet, (n,)."""
        self.failed = np.zeros(n, np.bool_)
        """True where the episode of `failed_key` has not been survived since, (n,)."""
        self.failed_key = np.zeros(n, np.uint64)
        """Key of the last failed episode, (n,)."""
        self.command = np.zeros((n, len(COMMAND)))
        """C in force, rate-limited and clamped, (n, 11)."""
        self.goal = np.zeros((n, len(COMMAND)))
        """Goal that the command approaches, (n, 11)."""
        self.height_rate = np.zeros(n)
        """Rate of change of the commanded height, (n,) [m/s]."""
        self.phase = np.zeros(n)
        """Gait phase, (n,)."""
        self.stepping = np.zeros(n, np.bool_)
        """True where the gait clock runs, (n,)."""
        self.feedback = np.zeros((n, FEEDBACK_SIZE))
        """Forward offset of left foot, right foot and both from their places in the stride, stretch of both legs [m],
        and turn of both hips [rad], (n, 5)."""
        self.arms = np.zeros((n, arms))
        """θ_I_ref, (n, 14) [rad]."""
        self.posture = np.zeros((n, support))
        """θ_S_ref without the gait prior, until the first step with it, (n, 15) [rad]."""
        self.support = np.zeros((n, support))
        """θ_S_ref with the gait prior, (n, 15) [rad]."""
        self.action = np.zeros((n, support))
        """a_{t−1}, (n, 15)."""
        self.earlier_action = np.zeros((n, support))
        """a_{t−2}, (n, 15)."""
        self.filtered_velocity = np.zeros((n, 3))
        """Low-passed v_sys in the plane, heading frame [m/s], and yaw rate [rad/s], (n, 3)."""
        self.excess_force = np.zeros((n, 2))
        """Low-passed horizontal force on the hands beyond what the transport needs, heading frame, (n, 2) [N]."""
        self.heading_offset = np.zeros(n)
        """Measured less true heading at the start of the episode, (n,) [rad]: the origin of the measured heading."""
        self.heading_reference = np.zeros(n)
        """Heading at the start plus the integrated commanded yaw rate, (n,) [rad]."""
        self.object_place = np.zeros((n, 3))
        """Offset of a held object from the middle of the wrist targets at the start, heading frame, (n, 3) [m]."""
        self.undisturbed = np.zeros(n, np.int64)
        """Control steps since an impulse or a push last acted, (n,)."""
        self.tracking = np.zeros((n, len(TRACKED)))
        """Sums of the scores of height and torso pitch over the episode, (n, tracked)."""
        self.walked = np.zeros(n, np.int64)
        """Control steps of the episode with a commanded planar velocity or yaw rate, (n,)."""
        self.commanded = np.zeros(n)
        """Displacement that the episode commanded, (n,) [m]."""
        self.covered = np.zeros(n)
        """Displacement along the command, at no more than the commanded speed, (n,) [m]."""
        self.heading_error = np.zeros(n)
        """Sum of the absolute heading errors of the episode, (n,) [rad]."""
        self.total = np.zeros(n)
        """Sum of the rewards of the episode, (n,)."""

    def clear(self, which: Indices) -> None:
        """Resets the fields of the last episode in some environments, (k,)."""
        for name in PER_EPISODE_FIELDS:
            getattr(self, name)[which] = 0
        self.undisturbed[which] = NEVER_DISTURBED
