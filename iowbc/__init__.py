"""Interaction-oriented whole-body control: recipes, training, evaluation and export of the paper's controller.

The names below are the public API; each is imported from its module on first access. Nothing else is imported here, not
even `typing`, so that the Ctrl-C handler of `iowbc/__main__.py` is installed early.
"""

import os
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from iowbc.commands.lookup import open_artifact as open_artifact
    from iowbc.control.sensors import Measured as Measured
    from iowbc.deploy.controller import Controller as Controller
    from iowbc.deploy.controller import Targets as Targets
    from iowbc.errors import IowbcError as IowbcError
    from iowbc.pipeline.store.artifact import Artifact as Artifact
    from iowbc.recipe.reading.loading import load_recipe as load_recipe
    from iowbc.recipe.recipe import Recipe as Recipe
    from iowbc.task.vector.vector_env import VectorEnv as VectorEnv

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # read when onnxruntime is imported; it sends telemetry otherwise

__version__ = "0.2.0"
_PLACES = {
    "Artifact": "iowbc.pipeline.store.artifact",
    "Controller": "iowbc.deploy.controller",
    "IowbcError": "iowbc.errors",
    "Measured": "iowbc.control.sensors",
    "Recipe": "iowbc.recipe.recipe",
    "Targets": "iowbc.deploy.controller",
    "VectorEnv": "iowbc.task.vector.vector_env",
    "load_recipe": "iowbc.recipe.reading.loading",
    "open_artifact": "iowbc.commands.lookup",
}
__all__ = [*_PLACES]


def __getattr__(name: str) -> "Any":
    if name not in _PLACES:
        raise AttributeError(f"module 'iowbc' has no attribute '{name}'; it has: {', '.join(__all__)}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
