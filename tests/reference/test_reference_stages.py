"""The stages rg-dataset and rg-fit as wholes: what they leave, that only the recipe decides it, how they fail."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reference_doubles import small_recipe
from stage_jobs import make_job

from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.errors import Interrupted, StageFailed
from iowbc.pipeline.stage import Job
from iowbc.recipe.reading.loading import load_recipe
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror, support_mirror
from iowbc.stages import rg_dataset, rg_fit

DATA = ("dataset.npz", "labelled.npz", "summary.json")

KILLED = """
import sys
from pathlib import Path
sys.path[:0] = {tests!r}
if __name__ == "__main__":
    from reference_doubles import small_recipe
    from stage_jobs import make_job
    from iowbc.stages import rg_dataset
    rg_dataset.run(make_job(Path({folder!r}), small_recipe(), workers=1))
"""


def summary(job: Job) -> Any:
    return json.loads((job.out / "summary.json").read_text())


def test_the_dataset_stage_leaves_data_and_figures(dataset_job: Job) -> None:
    for name in (*DATA, "figures/labelled_map.png", "figures/labels.png", "figures/crosscheck.png"):
        assert (dataset_job.out / name).stat().st_size > 0, name


def test_kept_and_rejected_add_up_and_each_rejection_has_its_reason(dataset_job: Job, robot: Robot) -> None:
    told, dataset = summary(dataset_job), Dataset.load(dataset_job.out / "dataset.npz")
    plan = SamplePlan(robot, dataset_job.recipe.rg, dataset_job.recipe.seed)
    assert len(dataset) + sum(told["rejected"].values()) == plan.count == told["metrics"]["samples"]
    assert sorted([*dataset.index, *dataset.rejected_index]) == list(range(plan.count))
    assert sum(told["rejected"].values()) == len(dataset.rejected_reason)


def test_mirrored_samples_have_mirrored_labels(dataset_job: Job, robot: Robot) -> None:
    """The robot's own numbers are symmetric to about 1e-4 only, which moves joints by milliradians."""
    assert summary(dataset_job)["metrics"]["mirror_pairs"] > 10
    assert summary(dataset_job)["metrics"]["mirror_p99"] < 3e-3


def test_static_labels_agree_with_optimal_control(dataset_job: Job) -> None:
    assert summary(dataset_job)["metrics"]["crosscheck_p90"] < dataset_job.recipe.rg.crosscheck.p90_limit


def test_commands_in_the_map_have_labels_around_them(dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    region = FeasibleMap.load(dataset_job.out / "labelled.npz")
    told = dataset.rejected_reason != "arms collide"
    rejected = region.contains(dataset.rejected_command[told, 0], dataset.rejected_command[told, 1]).sum()
    kept = region.contains(dataset.command[:, 0], dataset.command[:, 1]).sum()
    assert kept > 100
    assert rejected < 0.25 * kept


def test_the_number_of_workers_changes_no_byte(dataset_job: Job, tmp_path: Path) -> None:
    job = make_job(tmp_path, small_recipe(), workers=3)
    rg_dataset.run(job)
    for name in DATA:
        assert (job.out / name).read_bytes() == (dataset_job.out / name).read_bytes(), name


def test_after_kill_9_finished_shards_are_used_and_the_result_is_the_same(dataset_job: Job, tmp_path: Path) -> None:
    script = tmp_path / "killed.py"
    script.write_text(KILLED.format(tests=[str(folder) for folder in Path(__file__).parents[:2]], folder=str(tmp_path)))
    process = subprocess.Popen([sys.executable, str(script)], env=os.environ | {"OMP_NUM_THREADS": "1"})
    first = tmp_path / "work" / "shards" / "00000.shard"
    deadline = time.monotonic() + 120.0
    while not first.exists():
        assert process.poll() is None, "the stage ended before it was killed"
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    written = first.stat().st_mtime_ns
    job = make_job(tmp_path, small_recipe())
    rg_dataset.run(job)
    assert first.stat().st_mtime_ns == written
    for name in DATA:
        assert (job.out / name).read_bytes() == (dataset_job.out / name).read_bytes(), name


def test_an_interrupted_stage_says_so_and_leaves_no_artifact(tmp_path: Path) -> None:
    job = make_job(tmp_path, small_recipe(), interrupted=lambda: True)
    with pytest.raises(Interrupted):
        rg_dataset.run(job)
    assert not (job.out / "dataset.npz").exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sampling__height": {"low": 0.5, "high": 2.0}}, r"rg\.sampling\.height: 0\.5 to 2: g1 is 0\.792 m high"),
        ({"sampling__pitch": {"low": -0.5, "high": 2.0}}, r"rg\.sampling\.pitch: .* valid is within"),
        (
            {"sampling__joint_ranges": {"left_elbo_joint": {"low": 0, "high": 1}}},
            r"left_elbo_joint: is no joint of g1; valid: .*did you mean 'left_elbow_joint'",
        ),
        (
            {"sampling__joint_ranges": {"left_elbow_joint": {"low": 0, "high": 9}}},
            r"the joint's limits are -1\.047",
        ),
        (
            {"sampling__height": {"low": 0.85, "high": 0.86}, "sampling__samples": 32, "feasible__heights": 3},
            "no sample has a label",
        ),
    ],
)
def test_impossible_recipes_fail_with_what_is_valid(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(StageFailed, match=message):
        rg_dataset.run(make_job(tmp_path, small_recipe(**({"sampling__samples": 60} | changes))))


def test_labels_far_from_optimal_control_fail_the_stage(tmp_path: Path) -> None:
    recipe = small_recipe(sampling__samples=60, crosscheck__samples=2, crosscheck__p90_limit=1e-9)
    with pytest.raises(StageFailed, match=r"differ from optimal control by 0\.\d+ rad .* Worst: number \d+"):
        rg_dataset.run(make_job(tmp_path, recipe))


def test_labels_that_nothing_could_check_fail_the_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("iowbc.reference.labels.checks.compare_methods", lambda dataset, again: None)
    recipe = small_recipe(sampling__samples=60, crosscheck__samples=2)
    with pytest.raises(StageFailed, match=r"optimal control labels none of the 2 samples .* rg\.crosscheck\.samples"):
        rg_dataset.run(make_job(tmp_path, recipe))


@pytest.mark.slow
def test_optimal_control_alone_labels_a_dataset(tmp_path: Path) -> None:
    job = make_job(tmp_path, small_recipe(method="ocp", sampling__samples=48, feasible__heights=3, feasible__pitches=3))
    rg_dataset.run(job)
    assert len(Dataset.load(job.out / "dataset.npz")) > 20
    assert "crosscheck_p90" not in summary(job)["metrics"]


def test_the_fit_leaves_a_network_its_map_and_a_report(fit_job: Job, dataset_job: Job) -> None:
    for name in ("rg.safetensors", "rg.json", "figures/errors.png", "figures/joints.png", "figures/learning.png"):
        assert (fit_job.out / name).stat().st_size > 0, name
    report = json.loads((fit_job.out / "summary.json").read_text())
    assert set(report["gates"]) == set(type(fit_job.recipe.rg.fit.gates).model_fields)
    assert all(gate["passed"] for gate in report["gates"].values())


def test_the_fitted_map_lies_inside_that_of_the_labels_and_holds_the_default_posture(
    fit_job: Job, dataset_job: Job, robot: Robot
) -> None:
    labels = FeasibleMap.load(dataset_job.out / "labelled.npz")
    gentle = FeasibleMap.load(fit_job.out / "feasible.npz")
    assert labels.contains(gentle.low, gentle.pitch).all()
    assert labels.contains(gentle.high, gentle.pitch).all()
    assert gentle.contains(np.array([robot.default_height]), np.zeros(1))[0]


def test_a_map_without_gentle_commands_fails_the_stage(dataset_job: Job, tmp_path: Path) -> None:
    recipe = small_recipe(fit__epochs=1, feasible__jump=1e-9)
    with pytest.raises(StageFailed, match=r"feasible set is empty.*raise rg\.feasible\.jump"):
        rg_fit.run(make_job(tmp_path, recipe, inputs={"rg-dataset": dataset_job.out}))


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_quickstarts_map_leaves_ordinary_commands_alone(tmp_path: Path, robot: Robot) -> None:
    """Upright it reaches 0.75 m and more, leaning back as far as it is sampled; the default posture is not clamped."""
    recipe = load_recipe(Path("recipes/quickstart.yaml")).recipe
    data = make_job(tmp_path / "data", recipe, workers=2)
    rg_dataset.run(data)
    fit = make_job(tmp_path / "fit", recipe, inputs={"rg-dataset": data.out})
    rg_fit.run(fit)
    region = FeasibleMap.load(fit.out / "feasible.npz")
    height, pitch = np.meshgrid(np.linspace(0.6, robot.default_height, 8), np.linspace(0.0, 0.3, 7))
    assert region.contains(height.ravel(), pitch.ravel()).all()
    assert region.pitch[0] == recipe.rg.sampling.pitch.low
    assert np.interp(0.0, region.pitch, region.high) >= 0.75


def test_the_fit_is_the_same_on_every_run(fit_job: Job, dataset_job: Job, tmp_path: Path) -> None:
    job = make_job(tmp_path, small_recipe(), inputs={"rg-dataset": dataset_job.out}, workers=2)
    rg_fit.run(job)
    for name in ("rg.safetensors", "rg.json", "summary.json"):
        assert (job.out / name).read_bytes() == (fit_job.out / name).read_bytes(), name


def test_a_missed_gate_fails_the_stage_and_names_the_worst_samples(dataset_job: Job, tmp_path: Path) -> None:
    recipe = small_recipe(fit__epochs=1, fit__gates={"joint_rmse": 1e-3})
    with pytest.raises(StageFailed, match=r"joint_rmse is .*, the limit 0\.001.* Worst samples: number \d+ \(height"):
        rg_fit.run(make_job(tmp_path, recipe, inputs={"rg-dataset": dataset_job.out}))


def test_the_fitted_network_is_nearly_its_own_mirror_image(fit_job: Job, dataset_job: Job, robot: Robot) -> None:
    """Trained on mirror images, it differs from its mirror image by no more than from the labels."""
    network, dataset = ReferenceNetwork.load(fit_job.out), Dataset.load(dataset_job.out / "dataset.npz")
    arms, legs = interaction_mirror(robot), support_mirror(robot)
    plain = network(dataset.arm, dataset.command)
    image = legs(network(arms(dataset.arm), dataset.command))
    error = np.sqrt(((plain - dataset.support) ** 2).mean())
    assert np.sqrt(((plain - image) ** 2).mean()) < 2.0 * error
    assert error < 0.5 * np.sqrt((dataset.support.std(axis=0) ** 2).mean())
