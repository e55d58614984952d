"""The G1's support model, samples, and both stages run once at a small size."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.recipe.recipe import Recipe
from iowbc.recipe.reference import ReferenceGenerator
from iowbc.reference.sample import Sample
from iowbc.reference.support_model import SupportModel
from iowbc.robot.arms import ArmKinematics
from iowbc.robot.description import Robot, load_robot, robot_folder
from iowbc.stages.contract import Job

SMALL: dict[str, Any] = {
    "sampling": {"samples": 400, "mirrored_share": 0.1},
    "feasible": {"heights": 9, "pitches": 11, "steepest": 30.0},
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


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot(robot_folder("g1"))


@pytest.fixture(scope="session")
def recipe() -> ReferenceGenerator:
    return ReferenceGenerator()


@pytest.fixture(scope="session")
def support(robot: Robot, recipe: ReferenceGenerator) -> SupportModel:
    return SupportModel(robot, recipe.problem)


@pytest.fixture(scope="session")
def carrying(robot: Robot) -> Any:
    """Arms whose grips are 0.26 m ahead of an upright pelvis, 0.32 m apart and 0.1 m above it."""
    arms = ArmKinematics(robot)
    rotation, position = arms.torso_in_heading(np.zeros((1, 3)), np.zeros(1))
    wrists = np.array([[[0.26, 0.16, 0.10], [0.26, -0.16, 0.10]]])
    return arms.solve(arms.rest[None], np.einsum("nji,nsj->nsi", rotation, wrists - position[:, None]))[0]


@pytest.fixture(scope="session")
def command(carrying: Any) -> Callable[..., Sample]:
    """Makes a sample with the arms in the carrying posture."""

    def make(height: float, pitch: float, roll: float = 0.0, yaw: float = 0.0, payload: Any = (0.0, 0.0)) -> Sample:
        return Sample(carrying, np.array([height, pitch, roll, yaw]), np.array(payload))

    return make


@pytest.fixture(scope="session")
def dataset_job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """The stage rg-dataset, done at a small size with one worker."""
    from iowbc.stages import rg_dataset

    job = make_job(tmp_path_factory.mktemp("dataset"), small_recipe())
    rg_dataset.run(job)
    return job


@pytest.fixture(scope="session")
def fit_job(dataset_job: Job, tmp_path_factory: pytest.TempPathFactory) -> Job:
    """The stage rg-fit, done on the small dataset."""
    from iowbc.stages import rg_fit

    job = make_job(tmp_path_factory.mktemp("fit"), small_recipe(), inputs={"rg-dataset": dataset_job.out})
    rg_fit.run(job)
    return job
