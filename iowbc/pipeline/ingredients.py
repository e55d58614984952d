"""What the key of a stage is made of beside its inputs: its part of the recipe; and its code, which no key holds."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from iowbc.pipeline.stage import Stage
from iowbc.pipeline.store.digests import PACKAGE, code_digests


def deciding_slices(deciding: Mapping[str, Any], stage: Stage) -> dict[str, Any]:
    """By dotted path: the parts of what decides a recipe's results that a stage depends on."""
    return {path: slice_value(deciding, path, stage) for path in stage.slice}


def slice_value(values: Mapping[str, Any], path: str, stage: Stage) -> Any:
    """The part at a dotted path of what decides a recipe's results."""
    if path.split(".")[0] in ("execution", "stages"):
        raise ValueError(f"stage {stage.name}: '{path}' must not be part of a key")
    value: Any = values
    for part in path.split("."):
        if not isinstance(value, Mapping) or part not in value:
            raise ValueError(f"stage {stage.name}: its slice names '{path}', which decides nothing in a recipe")
        value = value[part]
    return value


def changed_code(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Names of the subpackages and modules whose code differs."""
    return sorted(name for name in old.keys() | new.keys() if old.get(name) != new.get(name))


@cache
def stage_code(stage: Stage) -> Mapping[str, str]:
    """Digests of a stage's own module and of the parts of the package that it declares."""
    module = stage.run.__module__.removeprefix("iowbc.")
    own = {module} if module != stage.run.__module__ else set()
    return code_digests(PACKAGE, own | set(stage.packages))
