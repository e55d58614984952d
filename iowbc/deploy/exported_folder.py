"""File names and lookup of exported folders; imports no NumPy, so that every command can use it."""

import json
import os
from pathlib import Path

from iowbc.errors import ContractBroken

EXPORT = "export"
"""Stage that writes such folders."""
SHORTEST_PREFIX = 4
"""Least length of a key's prefix that names an artifact, if it is unique."""
CONTRACT = "contract.json"
STEP = "step.onnx"
"""One control step: maps measurements, command, scene and state to joint targets and the next state."""
SETTLE = "settle.onnx"
"""Initial state."""
GOLDEN = "golden.npz"
RECIPE = "recipe.json"
"""The recipe's world, for running the policy in the simulation of its acceptance test."""
ROBOT = "robot"
"""Folder with the robot's description inside the exported folder."""
GENERATOR = "rg"
"""Folder with the reference generator, for simulations of the policy; the controller's graphs contain it."""


def exported_folder(word: Path | str) -> Path:
    """The folder `word`, or the export of the recipe with that name in `IOWBC_RUNS`, else `./runs`, or the one
    published with the repository. `RECIPE/export` and a prefix of a key are accepted, too, as in all commands. Raises
    ContractBroken for an ambiguous prefix, and where nothing has that name."""
    folder, runs = Path(word), Path(os.environ.get("IOWBC_RUNS") or "runs")
    name = str(word).removesuffix(f"/{EXPORT}")
    published = sorted(runs.glob(f"published/{EXPORT}/*"))
    shipped = [place for place in published if _recipe_name(place) == name]
    stored = {place.name: place for place in (*published, *runs.glob(f"store/{EXPORT}/*"))}
    keyed = [place for key, place in stored.items() if len(name) >= SHORTEST_PREFIX and key.startswith(name)]
    places = (folder, runs / name / EXPORT, *shipped)
    found = next((place for place in places if os.path.isfile(place / CONTRACT)), None)
    if found is None and len(keyed) > 1:
        raise ContractBroken(f"{name}: the keys of {len(keyed)} exports begin like that; give more characters")
    if found is None and not keyed and not os.path.exists(folder):
        made = [place.parent.name for place in runs.glob(f"*/{EXPORT}") if (place / CONTRACT).is_file()]
        names = sorted({*made, *filter(None, map(_recipe_name, published))})
        text = f"neither an export folder nor a recipe with an export; those with one: {', '.join(names) or 'none'}"
        raise ContractBroken(f"{word}: {text}")
    return found or next(iter(keyed), folder)


def _recipe_name(folder: Path) -> str | None:
    """Recipe name of an exported folder, if it can be read."""
    try:
        name = json.loads((folder / RECIPE).read_bytes())["name"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return name if isinstance(name, str) else None
