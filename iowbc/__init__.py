"""Interaction-oriented whole-body control: recipes, training, evaluation and export of the paper's controller."""

__version__ = "0.1.0"
