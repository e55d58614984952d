"""How a machine runs a recipe; not part of any key."""

from iowbc.recipe.section import Section


class Execution(Section):
    """How a machine runs a recipe; not part of any key."""
