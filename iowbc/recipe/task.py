"""The Markov decision process."""

from iowbc.recipe.section import Section


class Task(Section):
    """The Markov decision process."""
