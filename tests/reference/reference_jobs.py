"""Jobs for the two stages of the reference generator at a small size."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.pipeline.stage import Job
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder

SMALL: dict[str, Any] = {
    "sampling": {"samples": 400, "mirrored_share": 0.1},
    "feasible": {"heights": 9, "pitches": 11, "jump": 0.3},
    "crosscheck": {"samples": 3},
    "fit": {
        "epochs": 60,
        "batch": 64,
        "smoothness": {"lines": 20},
        "gates": {
            "joint_rmse": 0.3,
            "height_p95": 0.1,
            "pitch_p95": 0.3,
            "foot_p95": 0.1,
            "margin_p1": None,
            "jump": None,
        },
    },
}


@dataclass
class Notes:
    """A stage's report, kept."""

    said: list[str] = field(default_factory=list)

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        assert all(np.isfinite(value) for value in values.values())

    def progress(self, done: float, total: float, note: str = "") -> None:
        assert 0 <= done <= total

    def say(self, text: str) -> None:
        self.said.append(text)


def small_recipe(**changes: Any) -> Recipe:
    """The small recipe with other values, by dotted path with `__` for the dots."""
    rg = json.loads(json.dumps(SMALL))
    for path, value in changes.items():
        *sections, name = path.split("__")
        place = rg
        for section in sections:
            place = place.setdefault(section, {})
        place[name] = value
    return Recipe.model_validate({"name": "small", "rg": rg})


def make_job(
    folder: Path,
    recipe: Recipe,
    *,
    inputs: Mapping[str, Path] | None = None,
    workers: int = 1,
    key: str = "key",
    interrupted: Callable[[], bool] = lambda: False,
) -> Job:
    for name in ("out", "work"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    return Job(
        recipe=recipe,
        key=key,
        robot=robot_folder("g1"),
        inputs=inputs or {},
        out=folder / "out",
        work=folder / "work",
        workers=workers,
        report=Notes(),
        interrupted=interrupted,
    )
