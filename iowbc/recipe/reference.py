"""The reference generator: its dataset and its network."""

from iowbc.recipe.section import Section


class ReferenceGenerator(Section):
    """The reference generator: its dataset and its network."""
