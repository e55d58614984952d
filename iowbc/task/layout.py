"""Layout of the environments' observation rows: s_t, then s_priv."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from iowbc.arrays import Indices
from iowbc.control.layout import Layout
from iowbc.control.observation import ObservationLayout, observation_layout
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.robot.mirror import side_by_side
from iowbc.task.own_parts import own_parts
from iowbc.task.privileged import PRIVILEGED, Truth


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
