"""The residual action of the support branch."""

from pydantic import Field

from iowbc.recipe.section import Section


class Action(Section):
    """The residual action: joint position increments of the 15 support joints."""

    scale: float | None = Field(default=None, gt=0.0)
    """Radians of joint target per unit of action, for every joint; empty takes each joint's scale from `robot.yaml`."""
    bound: float = Field(default=5.0, gt=0.0)
    """Actions are clipped to plus and minus this, in units of action."""
