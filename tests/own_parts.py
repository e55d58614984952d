"""A part of s_priv in a file of one's own, for tests."""

from pathlib import Path
from typing import Any

from iowbc.recipe.beside import ModuleFile

VELOCITY = "def velocity(truth):\n    return truth.motion.base_velocity\n"
"""What `base_linear_velocity` is."""


def own_part(folder: Path, source: str = VELOCITY, **said: Any) -> dict[str, Any]:
    """The entry of a recipe, with its file taken in."""
    (folder / "parts.py").write_text(source)
    module = ModuleFile.taken_in(folder / "parts.py", "parts.py").model_dump(mode="json")
    return {"module": module, "function": "velocity", "mirror": [1, -1, 1], **said}
