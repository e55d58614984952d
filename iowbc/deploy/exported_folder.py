"""An exported folder: what its files are called, and where it lies; loads no numbers, so that every command may."""

import json
import os
from pathlib import Path

from iowbc.errors import ContractBroken

EXPORT = "export"
"""Stage that writes such folders."""
SHORTEST_PREFIX = 4
"""Characters of a key that are enough to name an artifact, where they are unique."""
CONTRACT = "contract.json"
STEP = "step.onnx"
"""One control step: measurements, wanted command, scene and state to joint targets and the next state."""
SETTLE = "settle.onnx"
"""The first state."""
GOLDEN = "golden.npz"
RECIPE = "recipe.json"
"""The recipe's world: with it the policy can be played in the simulation that accepted it."""
ROBOT = "robot"
"""Folder with the robot's description inside the exported folder."""
GENERATOR = "rg"
"""Folder with the reference generator, for a simulation of the policy; the controller has all of it in its graphs."""


def exported_folder(word: Path | str) -> Path:
    """A folder as it is named, or what the recipe of that name exported into `IOWBC_RUNS`, else `./runs`; where it was
    not run here, what came with the repository. `RECIPE/export` and the first characters of a key are names, too, as
    in all commands. Raises ContractBroken where several keys begin like that."""
    folder, runs = Path(word), Path(os.environ.get("IOWBC_RUNS") or "runs")
    name = str(word).removesuffix(f"/{EXPORT}")
    published = sorted(runs.glob(f"published/{EXPORT}/*"))
    shipped = [place for place in published if _recipe_name(place) == name]
    stored = {place.name: place for place in (*published, *runs.glob(f"store/{EXPORT}/*"))}
    keyed = [place for key, place in stored.items() if len(name) >= SHORTEST_PREFIX and key.startswith(name)]
    found = next((place for place in (folder, runs / name / EXPORT, *shipped) if (place / CONTRACT).is_file()), None)
    if found is None and len(keyed) > 1:
        raise ContractBroken(f"{name}: the keys of {len(keyed)} exports begin like that; give more characters")
    return found or next(iter(keyed), folder)


def _recipe_name(folder: Path) -> str | None:
    """Name of the recipe that an exported folder was made by, if it can be read."""
    try:
        name = json.loads((folder / RECIPE).read_bytes())["name"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return name if isinstance(name, str) else None
