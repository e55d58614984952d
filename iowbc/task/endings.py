"""Conditions that end an episode: falls, drops, lag behind the command, time limits, divergence."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.task.task import Termination
from iowbc.task.motion import Motion


@dataclass(frozen=True)
class Ending:
    """Reasons for which episodes end in a step, each (n,). A diverged one is neither fallen, dropped nor lagging."""

    fallen: Mask
    dropped: Mask
    lagging: Mask
    time_limit: Mask
    diverged: Mask

    @property
    def failed(self) -> Mask:
        """Fell, dropped the object, or did not follow the command."""
        return self.fallen | self.dropped | self.lagging

    @property
    def done(self) -> Mask:
        """Ended for any reason."""
        return self.failed | self.time_limit | self.diverged

    @property
    def truncated(self) -> Mask:
        """Reached the time limit without failing or diverging."""
        return self.time_limit & ~(self.failed | self.diverged)

    def reasons(self) -> dict[str, Mask]:
        """Exactly one reason for each episode that ended."""
        return {
            "fallen": self.fallen,
            "dropped": self.dropped & ~self.fallen,
            "lagging": self.lagging & ~(self.fallen | self.dropped),
            "time_limit": self.truncated,
            "diverged": self.diverged,
        }


def fallen(motion: Motion, pitch_command: Array, termination: Termination) -> Mask:
    """Base or torso beyond the limits, (n,); pitch_command (n,) [rad]."""
    return (
        (motion.pelvis_height < termination.pelvis_height)
        | (motion.pelvis_tilt > termination.pelvis_tilt)
        | (np.abs(motion.torso_roll) > termination.torso_roll)
        | (np.abs(motion.torso_pitch - pitch_command) > termination.torso_pitch_error)
    )


def lagging(lag: Array, heading_error: Array, followable: Mask, termination: Termination) -> Mask:
    """Too far behind the command, (n,): lag (n,) [m], heading error (n,) [rad], where the command can be followed."""
    late = np.zeros(len(lag), np.bool_)
    if termination.lag is not None:
        late |= lag > termination.lag
    if termination.heading_error is not None:
        late |= np.abs(heading_error) > termination.heading_error
    return late & followable


def dropped(motion: Motion, place: Array, held: Mask, grasped: Mask, termination: Termination) -> Mask:
    """A held object out of both hands, or too far from its place in the grasp, (n,). place: the object's place from the
    base, heading frame, (n, 3) [m]; grasped: hands that hold, (n, 2)."""
    distance = np.sqrt(np.square(motion.object_offset - place).sum(axis=1))
    return held & (~grasped.any(axis=1) | (distance > termination.object_distance))


def lost(motion: Motion, place: Array, pushed: Mask, termination: Termination) -> Mask:
    """A pushed object too far to the side of the hands, (n,); place: their middle from the base, heading frame, (n, 3)
    [m]."""
    if termination.object_beside is None:
        return np.zeros(len(pushed), np.bool_)
    return pushed & (np.abs(motion.object_offset - place)[:, 1] > termination.object_beside)
