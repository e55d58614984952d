"""The exported folder of an untrained policy."""

from exported_policies import exported, graph, recipe, rg

__all__ = ["exported", "graph", "recipe", "rg"]
