"""The G1's support model, samples, and both stages run once at a small size."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from reference_doubles import small_recipe
from stage_jobs import make_job

from iowbc.control.arms import ArmKinematics
from iowbc.pipeline.stage import Job
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import Robot


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

    def make(height: float, pitch: float) -> Sample:
        return Sample(carrying, np.array([height, pitch]))

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
