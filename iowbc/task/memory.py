"""What the task remembers of each environment between two control steps."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.control.command import COMMAND
from iowbc.task.rewards.table import TRACKED


@dataclass
class Memory:
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
    """Curriculum level, (n,)."""
    command: Array
    """C in force, rate-limited and clamped, (n, 11)."""
    goal: Array
    """Where the command goes, (n, 11)."""
    height_rate: Array
    """Rate of change of the commanded height, (n,) [m/s]."""
    phase: Array
    """Gait phase, (n,)."""
    stepping: Array
    """Whether the gait clock runs, (n,) bool."""
    arms: Array
    """θ_I_ref, (n, 14) [rad]."""
    posture: Array
    """θ_S_ref without the gait prior, (n, 15) [rad]."""
    support: Array
    """θ_S_ref with the gait prior, (n, 15) [rad]."""
    action: Array
    """a_{t−1}, (n, 15)."""
    filtered_velocity: Array
    """Low-passed v_sys in the plane, heading frame [m/s], and yaw rate [rad/s], (n, 3)."""
    heading_offset: Array
    """Measured less true heading at the start of the episode, (n,) [rad]: the origin of what is measured."""
    heading_reference: Array
    """Heading at the start plus the integrated commanded yaw rate, (n,) [rad]."""
    object_place: Array
    """A held object from the middle of the wrist targets at the start of the episode, heading frame, (n, 3) [m]."""
    tracking: Array
    """Sums of the tracking scores over the episode, (n, 4)."""
    total: Array
    """Sum of the rewards of the episode, (n,)."""

    @classmethod
    def blank(cls, n: int, arms: int, support: int) -> Self:
        """All zero."""
        counters = {name: np.zeros(n, np.int64) for name in ("episode", "draws", "steps", "limit", "goal_until")}
        scalars = ("level", "height_rate", "phase", "heading_offset", "heading_reference", "total")
        return cls(
            **counters,
            **{name: np.zeros(n) for name in scalars},
            tracking=np.zeros((n, len(TRACKED))),
            stepping=np.zeros(n, np.bool_),
            command=np.zeros((n, len(COMMAND))),
            goal=np.zeros((n, len(COMMAND))),
            arms=np.zeros((n, arms)),
            posture=np.zeros((n, support)),
            support=np.zeros((n, support)),
            action=np.zeros((n, support)),
            filtered_velocity=np.zeros((n, 3)),
            object_place=np.zeros((n, 3)),
        )

    def clear(self, which: Indices) -> None:
        """Forgets what belongs to the episode that has ended in some environments, (k,)."""
        for values in (self.action, self.filtered_velocity, self.tracking, self.total):
            values[which] = 0.0

    def arrays(self) -> dict[str, Array]:
        """Copies of all arrays, by name."""
        return {field.name: getattr(self, field.name).copy() for field in fields(self)}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Inverse of `arrays`; shapes must agree."""
        for field in fields(self):
            getattr(self, field.name)[...] = arrays[field.name]
