"""The world: physics, scenes, partner, randomisation, sensing."""

from iowbc.recipe.section import Section


class Simulation(Section):
    """The world: physics, scenes, partner, randomisation, sensing."""
