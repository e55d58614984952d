"""A recipe of the smallest trainings, and jobs for the stages that train."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stage_jobs import make_job

from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.recipe import Recipe

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
                "value_only": ["imu_tilt"],
                "check": {"every": 2, "trials": 1, "lifting": [0, 4], "sequence": [{"duration": 0.4, "ramp": 0.0}]},
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
                "withheld": ["motor_effort"],
            },
        }
    )


def stopped_and_resumed(stage: Stage, place: Path, recipe: Recipe, inputs: Mapping[str, Path] | None = None) -> Job:
    """Runs a stage that is asked to stop after its first update, then again to its end."""
    try:
        stage.run(make_job(place, recipe, inputs=inputs, workers=0, interrupted=lambda: True))
    except Interrupted:
        assert not list((place / "out").iterdir()), "an interrupted stage leaves no output"
    else:
        raise AssertionError("the stage did not stop when it was asked to")
    resumed = make_job(place, recipe, inputs=inputs, workers=0)
    stage.run(resumed)
    return resumed


def rows(work: Path) -> list[dict[str, float]]:
    """The rows of the learning curves without what the clock says."""
    lines = [json.loads(line) for line in (work / "curves.jsonl").read_text().splitlines()]
    return [{name: value for name, value in row.items() if "second" not in name or "episode" in name} for row in lines]
