"""PPO with privileged information."""

from iowbc.recipe.section import Section


class Teacher(Section):
    """PPO with privileged information."""
