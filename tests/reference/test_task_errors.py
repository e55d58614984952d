"""What a posture does to feet, height and torso: through forward kinematics, and to first order."""

from collections.abc import Callable

import numpy as np
import pytest

from iowbc.recipe.reference import ReferenceGenerator
from iowbc.reference.sample import Posture, Sample
from iowbc.reference.static import StaticMethod
from iowbc.reference.support_model import SupportModel
from iowbc.reference.task_error import TaskKinematics


@pytest.fixture(scope="module")
def kinematics(support: SupportModel) -> TaskKinematics:
    return TaskKinematics(support, "pelvis")


@pytest.fixture(scope="module")
def labelled(support: SupportModel, command: Callable[..., Sample]) -> tuple[Sample, Posture]:
    sample = command(0.66, 0.4)
    return sample, StaticMethod(support, "pelvis").solve(sample)


def test_a_label_has_no_foot_mismatch_and_reaches_its_command(
    kinematics: TaskKinematics, labelled: tuple[Sample, Posture], recipe: ReferenceGenerator
) -> None:
    sample, posture = labelled
    errors = kinematics.errors([sample], posture.support[None])
    assert errors.foot[0] < 1e-5
    assert errors.foot_rotation[0] < 1e-4
    assert abs(errors.height[0]) < recipe.gates.height
    assert abs(errors.pitch[0]) < recipe.gates.orientation
    assert errors.margin[0] > recipe.gates.support_margin


def test_the_pelvis_sinks_by_what_the_knees_bend(kinematics: TaskKinematics, command: Callable[..., Sample]) -> None:
    """Thigh and shank of about 0.3 m: bending both knees by k with hips and ankles at -k/2 lowers the pelvis."""
    sample, straight, bent = command(0.75, 0.0), np.zeros(15), np.zeros(15)
    for leg in (0, 6):
        bent[leg], bent[leg + 3], bent[leg + 4] = -0.4, 0.8, -0.4
    heights = kinematics.errors([sample, sample], np.stack([straight, bent])).height
    assert heights[0] - heights[1] == pytest.approx(2 * 0.3 * (1 - np.cos(0.4)), abs=0.015)


def test_the_jacobian_is_the_derivative_of_the_errors(
    kinematics: TaskKinematics, labelled: tuple[Sample, Posture]
) -> None:
    sample, posture = labelled
    jacobian = kinematics.jacobian(sample, posture.configuration)
    random = np.random.default_rng(1)
    for _ in range(5):
        move = random.normal(size=15)
        moved = np.stack([posture.support + 1e-4 * move, posture.support - 1e-4 * move])
        errors = kinematics.errors([sample, sample], moved)
        predicted = jacobian @ move
        assert np.diff(errors.height)[0] / -2e-4 == pytest.approx(predicted[6], abs=1e-3)
        assert np.diff(errors.pitch)[0] / -2e-4 == pytest.approx(predicted[8], abs=5e-3)
        assert errors.foot.mean() / 1e-4 == pytest.approx(np.linalg.norm(predicted[:3]), rel=2e-2)
        assert errors.foot_rotation.mean() / 1e-4 == pytest.approx(np.linalg.norm(predicted[3:6]), rel=2e-2)
