"""Scenes that only the trials have: what a trained policy is to do with objects that it never met."""

from pydantic import Field

from iowbc.recipe.section import Section
from iowbc.recipe.simulation.scene import Object, Scene


class TrialScene(Section):
    """A scene beside those of the training. What the policy observes does not change with it."""

    scene: Scene
    """The object and how it is held; it may also replace a scene of the training."""
    wrists: tuple[float, float, float]
    """Base grasp: left wrist from the pelvis, heading frame [m]; as an entry of `task.references.grasps`."""
    load: float | None = Field(default=0.0, ge=0.0)
    """What the arms expect to carry [kg], as an entry of `task.references.loads`; empty takes that of `lift`."""


BESIDE = 0.035
"""Distance of a wrist from the side of the box in its hands [m], in the scene `lift`."""


def box(width: float) -> TrialScene:
    """The box of the scene `lift` in another width [m], held as there."""
    thing = Object(shape="box", size=(0.30, width, 0.30), mass=7.0)
    return TrialScene(scene=Scene(kind="lift", object=thing), wrists=(0.30, width / 2 + BESIDE, 0.26), load=None)


SIZES = {"narrow_box": box(0.2), "wide_box": box(0.45)}
"""Boxes beyond the training's 0.25 m."""
