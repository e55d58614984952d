"""Progress of an episode: sums of commanded and achieved motion, for the curriculum."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import VELOCITY, YAW_RATE
from iowbc.recipe.task.task import Termination
from iowbc.robot.rotations import TINY
from iowbc.task.curriculum import EpisodeOutcome
from iowbc.task.endings import Ending
from iowbc.task.episode_state import EpisodeState
from iowbc.task.rewards.terms import progress


def follow(
    memory: EpisodeState, target: Array, error: Array, disturbed: Mask, termination: Termination, period: float
) -> None:
    """Adds the last step, of `period` [s], to the sums; `target`: target velocity, heading frame, (n, 2) [m/s];
    `error`: heading error, (n,) [rad]."""
    speed = np.hypot(target[:, 0], target[:, 1])
    along = progress(memory.filtered_velocity[:, :YAW_RATE], target)
    memory.walked += memory.command[:, VELOCITY].any(axis=1)
    memory.commanded += speed * period
    memory.covered += along * period
    memory.heading_error += np.abs(error)
    forgotten = memory.lag * (1.0 - period / termination.lag_time) + (speed - along) * period
    memory.lag[:] = np.where(speed > 0.0, np.maximum(forgotten, 0.0), 0.0)
    memory.undisturbed[:] = np.where(disturbed, 0, memory.undisturbed + 1)


def outcome(memory: EpisodeState, ending: Ending, period: float, blame: float) -> EpisodeOutcome:
    """Results of the episodes that end in this step; `blame`: time for which a disturbance counts as recent [s]."""
    steps = np.maximum(memory.steps, 1)
    moved = memory.commanded > TINY
    return EpisodeOutcome(
        survived=ending.truncated,
        progress_in_time=memory.steps / memory.limit,
        posture=memory.tracking.min(axis=1) / steps,
        walked=memory.walked * period,
        covered=np.where(moved, memory.covered / np.maximum(memory.commanded, TINY), 1.0),
        heading=memory.heading_error / steps,
        infeasible=memory.infeasible.copy(),
        stepping=memory.stepping.copy(),
        lagged=ending.lagging,
        disturbed=memory.undisturbed * period <= blame,
    )
