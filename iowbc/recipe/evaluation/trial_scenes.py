"""Scenes that only the trials have: what a trained policy is to do with objects that it never met."""

from pydantic import Field

from iowbc.recipe.section import Section
from iowbc.recipe.simulation.scene import Scene


class TrialScene(Section):
    """A scene beside those of the training. What the policy observes does not change with it."""

    scene: Scene
    """The object and how it is held; it may also replace a scene of the training."""
    wrists: tuple[float, float, float]
    """Base grasp: left wrist from the pelvis, heading frame [m]; as an entry of `task.references.grasps`."""
    load: float = Field(default=0.0, ge=0.0)
    """What the arms expect to carry [kg]; as an entry of `task.references.loads`."""
