"""On-policy distillation of the teacher into the student."""

from iowbc.recipe.section import Section


class Distillation(Section):
    """On-policy distillation of the teacher into the student."""
