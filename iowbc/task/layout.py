"""Layout of the environments' observation rows: s_t, then s_priv."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.control.observation import ObservationLayout, observation_layout
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.robot.mirror import MirrorMap, side_by_side
from iowbc.task.own_parts import own_parts
from iowbc.task.privileged import PrivilegedLayout, privileged_layout


@dataclass(frozen=True)
class FullLayout:
    """Places of s_t, s_priv and their parts in a row."""

    state: ObservationLayout
    extra: PrivilegedLayout

    @cached_property
    def observation(self) -> slice:
        """Place of s_t."""
        return slice(0, self.state.size)

    @cached_property
    def privileged(self) -> slice:
        """Place of s_priv."""
        return slice(self.state.size, self.size)

    @cached_property
    def size(self) -> int:
        return self.state.size + self.extra.size

    @cached_property
    def mirror(self) -> MirrorMap:
        """Mirror of a row, (size,), float32."""
        return side_by_side((self.state.mirror, self.extra.mirror))

    def describe(self) -> dict[str, list[dict[str, Any]]]:
        return {"observation": self.state.describe(), "privileged": self.extra.describe()}

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Place of each part; a part of s_priv is named `privileged/<name>`."""
        shift = self.state.size
        privileged = {f"privileged/{k}": slice(s.start + shift, s.stop + shift) for k, s in self.extra.slices.items()}
        return self.state.slices | privileged

    def privileged_places(self, names: Iterable[str]) -> NDArray[np.int64]:
        """Places in the row of parts of s_priv, by name."""
        parts = [np.arange(self.size)[self.slices[f"privileged/{name}"]] for name in names]
        return np.concatenate([np.zeros(0, np.int64), *parts])


def full_layout(recipe: Recipe, robot: Robot) -> FullLayout:
    """Layout of the observation rows of a recipe. Raises StageFailed for a user-defined part whose name is taken."""
    seen = recipe.task.observation
    return FullLayout(observation_layout(robot, seen.observe_object), privileged_layout(robot, own_parts(seen)))
