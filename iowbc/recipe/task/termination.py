"""When an episode ends early."""

from pydantic import Field

from iowbc.recipe.section import Section


class Termination(Section):
    """When an episode ends early, and what counts as a fall or a drop in evaluation."""

    pelvis_height: float = Field(default=0.3, ge=0.0)
    """Pelvis below this is a fall [m]."""
    pelvis_tilt: float = Field(default=1.3, gt=0.0)
    """Pelvis further than this from upright is a fall [rad]; wide, because deep torso pitch tilts the pelvis too."""
    torso_roll: float = Field(default=0.8, gt=0.0)
    """Torso rolled further than this is a fall [rad]."""
    torso_pitch_error: float = Field(default=0.9, gt=0.0)
    """Torso pitch further than this from its command is a fall [rad]."""
    lag: float | None = Field(default=None, gt=0.0)
    """An episode ends when robot and object are this far behind the command [m], forgotten with the time constant
    `lag_time`; empty never ends one. It costs like a fall, so that standing is no safe answer to a command to walk.
    Nothing that the policy observes tells the lag; with 0.5 m walking was learnt later.
    Only where the command can be followed: not in a push, not above level 1 of locomotion, not in trials."""
    lag_time: float = Field(default=3.0, gt=0.0)
    """Time in which a lag is forgotten [s]: at 0.4 m/s a robot may stand in place for 1.6 s, and three fifths of the
    commanded speed are never too slow."""
    heading_error: float | None = Field(default=1.2, gt=0.0)
    """An episode ends when the heading is this far from the integrated command [rad]; where, and empty, as above."""
    object_distance: float = Field(default=0.35, gt=0.0)
    """A held object further than this from its place in the grasp is dropped [m]."""
