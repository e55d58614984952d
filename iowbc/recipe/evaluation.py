"""Trials of the trained policy."""

from iowbc.recipe.section import Section


class Evaluation(Section):
    """Trials of the trained policy."""
