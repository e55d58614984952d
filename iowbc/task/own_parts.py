"""User-defined parts of s_priv. Their file is executed when a row is filled, not when a layout is read."""

from collections.abc import Iterator
from functools import cache, partial

from iowbc.arrays import Array
from iowbc.control.layout import Part
from iowbc.errors import StageFailed
from iowbc.recipe.task.task import CustomPart, Observation
from iowbc.robot.mirror import in_place
from iowbc.task.own_function import load_function
from iowbc.task.privileged import PRIVILEGED, Truth

CONTRACT = (
    "it takes the Truth (iowbc/task/privileged.py) of n environments and returns finite numbers, shape (n, k), "
    "where k is the number of signs in `mirror`"
)


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
