"""What policy and teacher see."""

from typing import Annotated, Literal

from pydantic import Field

from iowbc.recipe.section import LATER, OWN_NAME, Section
from iowbc.recipe.task.own_function import OwnFunction


class OwnPart(OwnFunction):
    """A part of s_priv that is a function in a file of one's own. It takes the `Truth` (iowbc/task/privileged.py) of n
    environments and returns k values for each, (n, k)."""

    mirror: tuple[Literal[-1, 1], ...] = Field(min_length=1, max_length=256)
    """Signs of the k values when left and right change places, (k,): −1 where a value changes its sign, as a vector's
    lateral component, a roll or a yaw does; 1 where it does not. Of a left and a right value give the mean, whose sign
    is 1, and the difference, whose sign is −1."""


class Observation(Section):
    """What policy and teacher see."""

    observe_object: bool = True
    """Whether s_t contains the object's pose and rates in the base frame (eq. 5); otherwise teacher and student have
    proprioception alone. `distill.observe_object` is for the student."""
    own: dict[Annotated[str, Field(pattern=f"^{OWN_NAME}$")], OwnPart] = Field(
        default_factory=dict, json_schema_extra=LATER
    )
    """Parts of s_priv of one's own, by name; only what trains or plays a policy that sees s_priv executes them."""
