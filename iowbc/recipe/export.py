"""The ONNX graph and its checks."""

from iowbc.recipe.section import Section


class Export(Section):
    """The ONNX graph and its checks."""
