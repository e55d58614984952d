"""A recipe of the smallest trainings, and jobs for the stages that train."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder

ENVIRONMENTS = 4


def small_recipe(**teacher: Any) -> Recipe:
    """Two updates of four environments for teacher and student; θ_S_ref is the default posture."""
    return Recipe.model_validate(
        {
            "name": "small",
            "stages": ["teacher", "distill"],
            "task": {"episode_duration": [0.2, 1.0], "references": {"use_rg": False}},
            "teacher": {
                "environments": ENVIRONMENTS,
                "rollout": 16,
                "steps": ENVIRONMENTS * 16 * 2,
                "minibatches": 2,
                "epochs": 2,
                "hidden": [16, 8],
                **teacher,
            },
            "distill": {
                "environments": ENVIRONMENTS,
                "rollout": 8,
                "steps": ENVIRONMENTS * 8 * 2,
                "hidden": [16],
                "batch": 32,
                "buffer": 256,
                "gradient_steps": 2,
            },
        }
    )


@dataclass
class Heard:
    """A report that keeps what it is told."""

    rows: list[tuple[int, dict[str, float]]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        self.rows.append((step, dict(values)))

    def progress(self, done: float, total: float, note: str = "") -> None:
        assert done <= total

    def say(self, text: str) -> None:
        self.lines.append(text)


def job(
    place: Path,
    recipe: Recipe,
    inputs: Mapping[str, Path] | None = None,
    interrupted: Callable[[], bool] = lambda: False,
) -> Job:
    """A job in `place`, stepped in this process; another one in the same place goes on where that one stopped."""
    out, work = place / "out", place / "work"
    out.mkdir(parents=True, exist_ok=True)
    work.mkdir(exist_ok=True)
    return Job(recipe, "key", robot_folder(recipe.robot), inputs or {}, out, work, 0, Heard(), interrupted)


def stopped_and_resumed(stage: Stage, place: Path, recipe: Recipe, inputs: Mapping[str, Path] | None = None) -> Job:
    """Runs a stage that is asked to stop after its first update, then again to its end."""
    try:
        stage.run(job(place, recipe, inputs, interrupted=lambda: True))
    except Interrupted:
        assert not list((place / "out").iterdir()), "an interrupted stage leaves no output"
    else:
        raise AssertionError("the stage did not stop when it was asked to")
    resumed = job(place, recipe, inputs)
    stage.run(resumed)
    return resumed


def rows(work: Path) -> list[dict[str, float]]:
    """The rows of the learning curves without what the clock says."""
    lines = [json.loads(line) for line in (work / "curves.jsonl").read_text().splitlines()]
    return [{name: value for name, value in row.items() if "second" not in name or "episode" in name} for row in lines]
