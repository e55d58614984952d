"""Layout of the environments' observation rows: s_t, then s_priv with its user-defined parts.

The file of a user-defined part is executed when a row is filled, not when a layout is read.
"""

from collections.abc import Iterable, Iterator
from functools import cache, partial
from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.control.layout import Layout, Part
from iowbc.control.observation import ObservationLayout, observation_layout
from iowbc.errors import StageFailed
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.task import CustomPart, Observation
from iowbc.robot.description import Robot
from iowbc.robot.mirror import in_place, side_by_side
from iowbc.task.own_function import load_function
from iowbc.task.privileged import PRIVILEGED, Truth

CONTRACT = (
    "it takes the Truth (iowbc/task/privileged.py) of n environments and returns finite numbers, shape (n, k), "
    "where k is the number of signs in `mirror`"
)


class FullLayout:
    """Places of s_t, s_priv and their parts in a row."""

    def __init__(self, state: ObservationLayout, extra: Layout[Truth]) -> None:
        self.state, self.extra = state, extra
        start, self.size = state.size, state.size + extra.size
        self.observation, self.privileged = slice(0, start), slice(start, self.size)
        self.mirror = side_by_side((state.mirror, extra.mirror))
        """Mirror of a row, (size,), float32."""
        privileged = {f"privileged/{k}": slice(s.start + start, s.stop + start) for k, s in extra.slices.items()}
        self.slices = state.slices | privileged
        """Place of each part; a part of s_priv is named `privileged/<name>`."""

    def describe(self) -> dict[str, list[dict[str, Any]]]:
        return {"observation": self.state.describe(), "privileged": self.extra.describe()}

    def privileged_places(self, names: Iterable[str]) -> Indices:
        """Places in the row of parts of s_priv, by name."""
        parts = [np.arange(self.size)[self.slices[f"privileged/{name}"]] for name in names]
        return np.concatenate([np.zeros(0, np.int64), *parts])


def full_layout(recipe: Recipe, robot: Robot) -> FullLayout:
    """Layout of the observation rows of a recipe. Raises StageFailed for a user-defined part whose name is taken."""
    seen = recipe.task.observation
    return FullLayout(observation_layout(robot, seen.observe_object), Layout((*PRIVILEGED, *own_parts(seen)), robot))


def own_parts(recipe: Observation) -> tuple[Part[Truth], ...]:
    """The user-defined parts in alphabetical order, because cache keys do not depend on their order in the recipe.
    Raises StageFailed for a name that is taken."""
    for path, text in taken_names(recipe):
        raise StageFailed(f"{path}: {text}")
    return tuple(_part(name, recipe.own[name]) for name in sorted(recipe.own))


def load_parts(recipe: Observation) -> None:
    """Executes their files. Raises StageFailed for one that cannot be used."""
    for name, part in recipe.own.items():
        load_function(_path(name), part, CONTRACT)


def taken_names(recipe: Observation) -> Iterator[tuple[str, str]]:
    """Dotted paths of user-defined parts whose name is taken, with error messages."""
    known = [part.name for part in PRIVILEGED]
    for name in recipe.own:
        if name in known:
            yield _path(name), "s_priv has a part of this name already; take another"


def _part(name: str, said: CustomPart) -> Part[Truth]:
    """Only the author knows unit and frame. The hash of the file and the mirror signs replace them, so that a change of
    either makes another observation."""
    unit = f"of {said.function} in {said.module.sha256[:12]}"
    frame = f"mirror {', '.join(map(str, said.mirror))}"
    function = cache(partial(load_function, _path(name), said, CONTRACT))  # executes the file at the first call

    def value(truth: Truth) -> Array:
        return function()(truth, (len(truth.motor_effort), len(said.mirror)))

    return Part(name, in_place(*said.mirror), unit, frame, value)


def _path(name: str) -> str:
    return f"task.observation.own.{name}"
