"""Each physical gate rejects what it is for, and passes a good label."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio
import pytest

from iowbc.errors import Rejected
from iowbc.recipe.generator import LabelGates, ReferenceGenerator
from iowbc.reference.labels.checks import LabelChecker
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel


@pytest.fixture(scope="module")
def sample(command: Callable[..., Sample]) -> Sample:
    return command(0.66, 0.3)


@pytest.fixture
def label(support: SupportModel, sample: Sample) -> Posture:
    return StaticMethod(support).solve(sample)


@pytest.fixture(scope="module")
def judge(support: SupportModel) -> LabelChecker:
    return LabelChecker(support, LabelGates())


def moved(support: SupportModel, posture: Posture, **tangent: float) -> Posture:
    """The posture with parts of the base or joints moved."""
    names = ["x", "y", "z", "roll", "pitch", "yaw", *(support.robot.joints[index] for index in support.robot.support)]
    step = np.zeros(support.model.nv)
    for name, value in tangent.items():
        step[names.index(name)] = value
    return Posture(pinocchio.integrate(support.model, posture.configuration, step), posture.wrench)


def test_a_good_label_passes_with_its_evidence(judge: LabelChecker, sample: Sample, label: Posture) -> None:
    evidence = judge.label(sample, label)
    assert evidence["reached"] == pytest.approx(0.66, abs=0.002)
    assert 0.04 < evidence["margin"] < 0.12
    assert evidence["torque"].shape == (15,)
    assert 10.0 < np.abs(evidence["torque"]).max() < 50.0


def test_a_label_of_other_arms_is_not_in_equilibrium(
    support: SupportModel, judge: LabelChecker, sample: Sample, label: Posture, carrying: Any
) -> None:
    stretched = carrying.copy()
    stretched[[0, 7]] -= 0.8  # shoulder pitch
    other = Sample(stretched, sample.command)
    support.lock(other)
    with pytest.raises(Rejected, match="equilibrium"):
        judge.label(other, label)


@pytest.mark.parametrize("joint", ["left_ankle_pitch_joint", "right_hip_roll_joint", "left_knee_joint"])
def test_a_moved_foot_is_rejected(
    support: SupportModel, judge: LabelChecker, sample: Sample, label: Posture, joint: str
) -> None:
    with pytest.raises(Rejected, match="feet"):
        judge.label(sample, moved(support, label, **{joint: 0.02}))


def test_another_height_or_torso_is_rejected(
    judge: LabelChecker, label: Posture, command: Callable[..., Sample]
) -> None:
    with pytest.raises(Rejected, match="height"):
        judge.label(command(0.675, 0.3), label)
    with pytest.raises(Rejected, match="orientation"):
        judge.label(command(0.66, 0.34), label)


def test_wrenches_that_do_not_carry_the_robot_are_rejected(judge: LabelChecker, sample: Sample, label: Posture) -> None:
    with pytest.raises(Rejected, match="equilibrium"):
        judge.label(sample, Posture(label.configuration, 0.99 * label.wrench))


def test_a_foot_that_pulls_is_rejected(judge: LabelChecker, sample: Sample, label: Posture) -> None:
    """All weight on the right, and more, with the couple that this takes made by the soles' moments."""
    wrench = label.wrench.copy()
    shift = wrench[0, 2] + 5.0
    wrench[0, 2] -= shift
    wrench[1, 2] += shift
    width = 2.0 * judge.support.stance[0].translation[1]
    wrench[1, 3] += shift * width
    with pytest.raises(Rejected, match="friction or centre of pressure"):
        judge.label(sample, Posture(label.configuration, wrench))


def test_a_heavy_load_fails_the_torque_gate(
    support: SupportModel, judge: LabelChecker, sample: Sample, label: Posture, recipe: ReferenceGenerator
) -> None:
    weak = SupportModel(support.robot, recipe.problem.model_copy(update={"effort_fraction": 0.05}))
    weak.lock(sample)
    with pytest.raises(Rejected, match="torque"):
        LabelChecker(weak, LabelGates()).label(sample, label)


def test_a_small_support_margin_is_rejected(support: SupportModel, sample: Sample, label: Posture) -> None:
    strict = LabelChecker(support, LabelGates(support_margin=0.2))
    with pytest.raises(Rejected, match="support margin"):
        strict.label(sample, label)


def test_numbers_that_are_not_finite_are_rejected(judge: LabelChecker, sample: Sample, label: Posture) -> None:
    broken = label.configuration.copy()
    broken[9] = np.nan
    with pytest.raises(Rejected, match="not finite"):
        judge.label(sample, Posture(broken, label.wrench))


def test_crossed_arms_are_rejected_before_anything_is_solved(
    judge: LabelChecker, sample: Sample, carrying: Any
) -> None:
    judge.arms(sample)
    crossed = carrying.copy()
    crossed[1], crossed[8] = -0.6, 0.6  # shoulder roll inward
    with pytest.raises(Rejected, match="arms collide"):
        judge.arms(Sample(crossed, sample.command))
