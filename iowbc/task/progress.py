"""Progress of an episode: sums of commanded and achieved motion, for the curriculum."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import VELOCITY, YAW_RATE
from iowbc.recipe.task.task import Termination
from iowbc.robot.rotations import TINY
from iowbc.task.endings import Ending
from iowbc.task.episode_state import EpisodeState
from iowbc.task.rewards.terms import progress


def follow(
    memory: EpisodeState, target: Array, error: Array, disturbed: Mask, termination: Termination, period: float
) -> None:
    """Adds a step of `period` [s]; `target`: velocity, heading frame, (n, 2) [m/s]; `error` of heading, (n,) [rad]."""
    speed = np.hypot(target[:, 0], target[:, 1])
    along = progress(memory.filtered_velocity[:, :YAW_RATE], target)
    memory.walked += memory.command[:, VELOCITY].any(axis=1)
    memory.commanded += speed * period
    memory.covered += along * period
    memory.heading_error += np.abs(error)
    forgotten = memory.lag * (1.0 - period / termination.lag_time) + (speed - along) * period
    memory.lag[:] = np.where(speed > 0.0, np.maximum(forgotten, 0.0), 0.0)
    memory.undisturbed[:] = np.where(disturbed, 0, memory.undisturbed + 1)


class EpisodeOutcome:
    """Results of the episodes of n environments, each (n,); valid where an episode ends in this step."""

    def __init__(self, memory: EpisodeState, ending: Ending, period: float, blame: float) -> None:
        """`blame`: time for which a disturbance counts as recent [s]."""
        steps = np.maximum(memory.steps, 1)
        moved = memory.commanded > TINY
        self.survived = ending.truncated
        """Reached the time limit."""
        self.progress_in_time = memory.steps / memory.limit
        """Fraction of the time limit that was reached."""
        self.posture = memory.tracking.min(axis=1) / steps
        """The worse of the mean scores of height and pitch, 0 to 1."""
        self.walked = memory.walked * period
        """Time with a commanded velocity [s]."""
        self.covered = np.where(moved, memory.covered / np.maximum(memory.commanded, TINY), 1.0)
        """Fraction of the commanded displacement that was covered; 1 if none was commanded."""
        self.heading = memory.heading_error / steps
        """Mean heading error [rad]."""
        self.infeasible = memory.infeasible.copy()
        """The crate's rolling resistance exceeded the friction of the feet."""
        self.stepping = memory.stepping.copy()
        """The gait clock was running at the end."""
        self.lagged = ending.lagging
        """Ended because it lagged behind the command."""
        self.disturbed = memory.undisturbed * period <= blame
        """An impulse or a push acted shortly before the end."""
