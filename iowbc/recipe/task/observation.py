"""What the policy sees."""

from iowbc.recipe.section import Section


class Observation(Section):
    """What the policy sees beside the privileged quantities."""

    observe_object: bool = True
    """Whether s_t contains the object's pose and rates in the base frame (eq. 5); otherwise proprioception alone."""
