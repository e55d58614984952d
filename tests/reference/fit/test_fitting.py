"""The fit: it learns, it repeats itself, and its errors are measured through forward kinematics."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio
import pytest

from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job
from iowbc.recipe.generator import Fit, FitGates, ReferenceGenerator, SmoothnessCheck
from iowbc.reference.fit.errors import TaskErrors, check_fit, measure_jumps, task_errors, task_jacobian
from iowbc.reference.fit.fitting import FitData, fit, split_by_group
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.support_model import Sample, SupportModel


def toy(count: int, seed: int) -> FitData:
    """A smooth function of two of the inputs, with a Jacobian that looks at the first joint."""
    random = np.random.default_rng(seed)
    inputs = random.uniform(-1.0, 1.0, (count, 16))
    outputs = np.zeros((count, 15))
    outputs[:, 0] = np.sin(2.0 * inputs[:, 0])
    outputs[:, 1] = inputs[:, 15] ** 2
    jacobian = np.zeros((count, 10, 15), dtype=np.float32)
    jacobian[:, 6, 0] = 0.3
    return FitData(inputs, outputs, jacobian)


def learn(recipe: Fit, seed: int = 0, stop_at: int = 10**9) -> Any:
    seen = [0]

    def done(epoch: int, training: float, validation: float) -> None:
        seen[0] = epoch

    return fit(toy(2000, 1), toy(200, 2), recipe, seed, done, lambda: seen[0] >= stop_at)


def test_it_learns_a_smooth_function() -> None:
    fitted = learn(Fit(epochs=40, hidden=(32, 16), batch=64))
    assert min(fitted.validation_loss) < 0.2 * fitted.validation_loss[0]
    assert 1 <= fitted.epochs <= 40


def test_the_same_seed_gives_the_same_network() -> None:
    recipe = Fit(epochs=3, hidden=(16,))
    first, second, other = learn(recipe), learn(recipe), learn(recipe, seed=1)
    for a, b in zip(first.layers, second.layers, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
    assert not np.array_equal(first.layers[0][0], other.layers[0][0])


def test_it_stops_early_and_keeps_the_best_epoch() -> None:
    fitted = learn(Fit(epochs=200, hidden=(8,), learning_rate=1e-9, patience=4))
    assert len(fitted.validation_loss) <= 200
    assert fitted.epochs == int(np.argmin(fitted.validation_loss)) + 1
    impatient = learn(Fit(epochs=60, hidden=(8,), learning_rate=0.3, patience=1))
    assert len(impatient.validation_loss) < 60


def test_it_stops_when_asked() -> None:
    with pytest.raises(Interrupted):
        learn(Fit(epochs=50, hidden=(8,)), stop_at=2)


def test_groups_stay_on_one_side_of_the_split() -> None:
    group = np.concatenate([np.arange(90), np.arange(10)])
    train, validation, held = split_by_group(group, 0.05, 0.1, seed=0)
    parts = [set(group[part]) for part in (train, validation, held)]
    assert not parts[0] & parts[1]
    assert not parts[0] & parts[2]
    assert not parts[1] & parts[2]
    assert sorted(np.concatenate([train, validation, held])) == list(range(100))
    assert len(parts[2]) == 9


def test_too_few_samples_to_split_are_named() -> None:
    with pytest.raises(ValueError, match=r"2 independent samples are too few.*rg\.sampling\.samples"):
        split_by_group(np.array([0, 1, 1]), 0.05, 0.1, seed=0)


def test_a_label_has_no_task_error(support: SupportModel, command: Callable[..., Sample]) -> None:
    sample = command(0.62, 0.45)
    errors = task_errors(support, [sample], StaticMethod(support).solve(sample).support[None])
    assert abs(errors.height[0]) < 2e-3
    assert abs(errors.pitch[0]) < 5e-3
    assert errors.foot[0] < 1e-4
    assert errors.foot_rotation[0] < 1e-4
    assert 0.04 < errors.margin[0] < 0.12


def test_a_longer_leg_lifts_spreads_and_tilts(
    robot: Any, support: SupportModel, command: Callable[..., Sample]
) -> None:
    sample = command(0.62, 0.2)
    posture = StaticMethod(support).solve(sample).support
    names = [robot.joints[index] for index in robot.support]
    both = posture.copy()
    for side in ("left", "right"):  # both knees stretch, hips and ankles keep soles and trunk level
        both[names.index(f"{side}_knee_joint")] -= 0.1
        both[names.index(f"{side}_hip_pitch_joint")] += 0.05
        both[names.index(f"{side}_ankle_pitch_joint")] += 0.05
    one = posture.copy()
    one[names.index("left_ankle_pitch_joint")] += 0.02
    before, after, uneven = (task_errors(support, [sample], q[None]) for q in (posture, both, one))
    assert after.height[0] > before.height[0] + 0.01
    assert after.foot[0] < 1e-3
    assert uneven.foot_rotation[0] == pytest.approx(0.01, rel=0.02)
    assert uneven.foot[0] > 1e-4


def test_the_task_jacobian_is_the_derivative(support: SupportModel, command: Callable[..., Sample]) -> None:
    sample = command(0.62, 0.3)
    label = StaticMethod(support).solve(sample)
    jacobian = task_jacobian(support, sample, label.configuration)
    step, random = 1e-5, np.random.default_rng(0)
    for _ in range(10):
        direction = random.normal(size=15)
        ahead = task_errors(support, [sample], (label.support + step * direction)[None])
        behind = task_errors(support, [sample], (label.support - step * direction)[None])
        predicted = jacobian @ direction
        assert (ahead.height[0] - behind.height[0]) / (2 * step) == pytest.approx(predicted[6], abs=2e-3)
        foot = step * np.linalg.norm(predicted[:3])
        assert ahead.foot[0] == pytest.approx(foot, rel=0.1, abs=2e-5)
        assert ahead.foot_rotation[0] == pytest.approx(step * np.linalg.norm(predicted[3:6]), rel=0.1, abs=2e-5)


def linear_network(slope: float) -> ReferenceNetwork:
    """The first joint is `slope` times the height; nothing else moves."""
    weight = np.zeros((15, 16), dtype=np.float32)
    weight[0, 14] = slope
    return ReferenceNetwork(
        inputs=tuple(f"i{i}" for i in range(16)),
        outputs=tuple(f"o{i}" for i in range(15)),
        layers=((weight, np.zeros(15, np.float32)),),
        input_mean=np.zeros(16, np.float32),
        input_std=np.ones(16, np.float32),
        output_mean=np.zeros(15, np.float32),
        output_std=np.ones(15, np.float32),
        lower=np.full(15, -100.0, np.float32),
        upper=np.full(15, 100.0, np.float32),
    )


def test_the_jump_is_the_slope_times_a_step() -> None:
    recipe = ReferenceGenerator(fit=Fit(smoothness=SmoothnessCheck(lines=200)))
    region = FeasibleMap(np.array([0.0, 1.0]), np.array([0.5, 0.5]), np.array([0.8, 0.8]))
    jumps = measure_jumps(linear_network(8.0), recipe, region, np.zeros((3, 14)), seed=0)
    assert jumps.max() <= 8.0 * 0.005 + 1e-6
    assert jumps.max() > 0.5 * 8.0 * 0.005


def judged(gates: FitGates, dataset: Dataset, bend: float) -> Any:
    held = np.arange(20)
    predicted = dataset.support[held].copy()
    predicted[7, 3] += bend
    zero = np.zeros(20)
    errors = TaskErrors(zero, zero, zero, zero, np.full(20, 0.08))
    return check_fit(gates, dataset, held, predicted, errors, np.array([0.01]))


def test_a_missed_gate_is_named_with_its_worst_samples(dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    good = judged(FitGates(), dataset, 0.0)
    assert good.failures == []
    bad = judged(FitGates(), dataset, 1.0)
    assert len(bad.failures) == 1
    assert bad.failures[0].startswith("joint_rmse is 0.05774, the limit 0.016")
    assert f"number {dataset.index[7]} " in bad.worst[0]
    assert bad.gates["joint_rmse"]["passed"] is False
    assert judged(FitGates(joint_rmse=None), dataset, 1.0).failures == []


def test_the_margin_gate_looks_at_the_low_end(dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    assert judged(FitGates(margin_p1=0.09), dataset, 0.0).failures == ["margin_p1 is 0.08, the limit 0.09"]


def test_predictions_are_placed_on_both_soles(support: SupportModel, command: Callable[..., Sample]) -> None:
    """A rigid motion of the whole robot changes nothing: only joints enter."""
    sample = command(0.66, 0.1)
    label = StaticMethod(support).solve(sample)
    com = pinocchio.centerOfMass(support.model, support.data, label.configuration)
    margin = task_errors(support, [sample], label.support[None]).margin[0]
    assert margin == pytest.approx(0.0, abs=0.2)
    assert np.abs(com[:2]).max() < 0.01
