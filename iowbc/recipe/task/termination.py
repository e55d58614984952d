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
    object_distance: float = Field(default=0.35, gt=0.0)
    """A held object further than this from its place in the grasp is dropped [m]."""
