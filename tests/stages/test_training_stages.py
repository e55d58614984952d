"""The stages that train, whole: what they leave, and that stopping and going on changes nothing."""

import dataclasses
import json
import os
import runpy
import shutil
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch
from changes import changed
from mirrored import mirror_tensor
from safetensors.numpy import load_file
from stable_baselines3 import PPO
from stage_jobs import Backwards, make_job
from training_jobs import ENVIRONMENTS, rows, small_recipe, stopped_and_resumed

from iowbc.control.action import action_mirror
from iowbc.errors import Interrupted, StageFailed
from iowbc.evaluation.trials.plan import command_script
from iowbc.learning.acting import StudentPolicy, load_policy, policy_of
from iowbc.learning.checkpoint import load_checkpoint, save_checkpoint
from iowbc.learning.storage import load_network, load_teacher
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING
from iowbc.recipe.execution import Execution
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot, robot_folder
from iowbc.stages import distill, export, teacher
from iowbc.stages import eval as evaluate
from iowbc.stages.environments import WRITTEN, RolloutActor
from iowbc.stages.inputs import leaves_student
from iowbc.task.batch import Batch
from iowbc.task.gym.environment import Environment
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.vector_env import VectorEnv
from iowbc.task.vector.worker import Message

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a teacher and a student were trained without a break."""
    place = tmp_path_factory.mktemp("trained")
    teacher.STAGE.run(make_job(place / "teacher", small_recipe(), workers=0))
    distill.STAGE.run(
        make_job(place / "distill", small_recipe(), inputs={"teacher": place / "teacher" / "out"}, workers=0)
    )
    return place


def test_a_teacher_that_was_stopped_and_resumed_is_the_unbroken_one_bit_for_bit(trained: Path, tmp_path: Path) -> None:
    resumed = stopped_and_resumed(teacher.STAGE, tmp_path, small_recipe())
    assert resumed.report.lines == ["resumed from its checkpoint at 64 of 128 steps"]  # type: ignore[attr-defined]
    for name in ("teacher.safetensors", "teacher.json"):
        assert (tmp_path / "out" / name).read_bytes() == (trained / "teacher" / "out" / name).read_bytes(), name
    assert rows(tmp_path / "work") == rows(trained / "teacher" / "work")


def test_a_checkpoint_of_environments_with_another_state_is_refused_and_stays(tmp_path: Path) -> None:
    with pytest.raises(Interrupted):
        teacher.STAGE.run(make_job(tmp_path, small_recipe(), workers=0, interrupted=lambda: True))
    job = make_job(tmp_path, small_recipe(), workers=0)
    path = tmp_path / "work" / "training.checkpoint"
    arrays = load_checkpoint(path, job.key, print)
    assert arrays is not None
    narrower = {"environment/task/feedback": arrays["environment/task/feedback"][:, 1:]}
    save_checkpoint(path, job.key, arrays | narrower)
    before = path.read_bytes()
    with pytest.raises(StageFailed, match=r"training.checkpoint: written by another version.*'task/feedback'.*remove"):
        teacher.STAGE.run(job)
    assert path.read_bytes() == before


def test_rollouts_by_other_machines_that_are_lost_all_the_time_change_nothing(trained: Path, tmp_path: Path) -> None:
    asked = small_recipe().model_copy(update={"execution": Execution(rollout_actors=2)})
    for stage in (teacher.STAGE, distill.STAGE):
        assert stage.spreads(asked)
        assert not stage.spreads(small_recipe())
        inputs = {"teacher": trained / "teacher" / "out"} if stage is distill.STAGE else {}
        job = make_job(tmp_path / stage.name, asked, inputs=inputs, workers=0)
        elsewhere = Backwards()
        stage.run(dataclasses.replace(job, spread=elsewhere))
        assert elsewhere.pools == [2], "two groups, each by a member of its own"
        for name in stage.results:
            assert (job.out / name).read_bytes() == (trained / stage.name / "out" / name).read_bytes(), name
        assert rows(job.work) == rows(trained / stage.name / "work")


def test_a_group_on_another_machine_reads_what_lies_there() -> None:
    there = Path("/nowhere")
    world = Specification(small_recipe(), there / "g1", there / "rg")
    group = RolloutActor(Setup(world, 4, 0), 2, 4, robot=robot_folder("g1"))
    written = {name: group.state()[f"buffer/{name}"] for name in WRITTEN}
    assert group.ask((written, Message(Batch.reset))) is None
    assert len(group.state()["buffer/observation"]) == 2


@pytest.mark.timeout(600)
def test_an_actor_that_is_killed_on_ray_changes_nothing(trained: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    script = Path(__file__).with_name("lost_actor.py")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run(
        [sys.executable, script, tmp_path], env=environment, capture_output=True, text=True, check=False
    )
    assert "2 actors, one of them killed" in run.stdout, run.stderr
    for name in ("teacher.safetensors", "teacher.json", "state.safetensors"):
        assert (tmp_path / "out" / name).read_bytes() == (trained / "teacher" / "out" / name).read_bytes(), name
    assert rows(tmp_path / "work") == rows(trained / "teacher" / "work")


def test_a_longer_training_goes_on_from_the_finished_one_as_if_it_had_never_stopped(
    trained: Path, tmp_path: Path
) -> None:
    longer = small_recipe(steps=ENVIRONMENTS * 16 * 3)
    teacher.STAGE.run(make_job(tmp_path / "unbroken", longer, workers=0))
    job = make_job(tmp_path / "extended", longer, workers=0, key="longer")
    job = dataclasses.replace(job, predecessor=trained / "teacher" / "out")
    teacher.STAGE.run(job)
    assert job.report.lines == ["goes on from a finished training at 128 of 192 steps"]  # type: ignore[attr-defined]
    for name in ("teacher.safetensors", "teacher.json"):
        paths = [tmp_path / which / "out" / name for which in ("unbroken", "extended")]
        assert paths[0].read_bytes() == paths[1].read_bytes(), name
    assert rows(tmp_path / "unbroken" / "work") == rows(tmp_path / "extended" / "work")


@pytest.mark.parametrize("history", [None, {"length": 3}])
def test_a_training_begins_as_the_policy_of_another_one_while_its_value_learns(
    tmp_path: Path, history: dict[str, int] | None
) -> None:
    first = make_job(tmp_path / "first", small_recipe(history=history), workers=0)
    teacher.STAGE.run(first)
    for name in ("state.safetensors", "teacher_sb3.zip"):
        (first.out / name).unlink()
    before = load_file(first.out / "teacher.safetensors")
    steps = ENVIRONMENTS * 16
    recipe = small_recipe(history=history, steps=steps, value_first=steps)
    job = make_job(tmp_path / "second", recipe, inputs={"start": first.out}, workers=0)
    teacher.STAGE.run(job)
    after = load_file(job.out / "teacher.safetensors")
    assert after.keys() == before.keys()
    for name, value in before.items():
        np.testing.assert_array_equal(after[name], value, err_msg=name)
    state = load_file(job.out / "state.safetensors")
    assert state["counters"].tolist() == [64], "its own steps"
    longer = make_job(tmp_path / "longer", small_recipe(history=history, steps=2 * steps, value_first=steps), workers=0)
    teacher.STAGE.run(dataclasses.replace(longer, inputs={"start": first.out}, predecessor=job.out))
    learnt = load_file(longer.out / "state.safetensors")
    assert any(not np.array_equal(value, state[name]) for name, value in learnt.items() if "actor" in name)


def test_a_training_begins_as_a_distilled_student_while_its_value_learns(trained: Path, tmp_path: Path) -> None:
    start, steps = trained / "distill" / "out", ENVIRONMENTS * 16
    history = {"estimate": True, "student": "0123abcd"}
    recipe = small_recipe(history=history, steps=steps, value_first=steps)
    assert {one.stage for one in teacher.STAGE.borrows(recipe).values()} == {"distill"}
    job = make_job(tmp_path / "same", recipe, inputs={"start": start}, workers=0)
    teacher.STAGE.run(job)
    before, after = load_file(start / "student.safetensors"), load_file(job.out / "teacher.safetensors")
    assert after.keys() == before.keys()
    for name in before.keys() - {"log_std"}:
        np.testing.assert_array_equal(after[name], before[name], err_msg=name)
    learning = small_recipe(history=history, steps=steps, value_first=0)
    job = make_job(tmp_path / "learning", learning, inputs={"start": start}, workers=0)
    teacher.STAGE.run(job)
    learnt = load_file(job.out / "state.safetensors")
    moved = [
        name
        for name, value in before.items()
        if not np.array_equal(learnt.get(f"policy/actor.network.{name}", value), value)
    ]
    assert {name.split(".")[0] for name in moved} == {"encoder", "estimate", "body"}, "all of it goes on learning"
    other = make_job(
        tmp_path / "other", small_recipe(history={"student": "0123abcd"}), inputs={"start": start}, workers=0
    )
    with pytest.raises(StageFailed, match=r"^teacher\.history\.student: .*estimate"):
        teacher.STAGE.run(other)
    with pytest.raises(ValueError, match="give one of them"):
        small_recipe(history=history, start="full.yaml")


@pytest.mark.parametrize(
    ("task", "changes", "text"),
    [
        ({}, {"hidden": [16, 16]}, "networks are other ones"),
        ({"observation": {"observe_object": False}}, {}, "observes something else"),
    ],
)
def test_a_beginning_that_does_not_fit_is_refused(
    trained: Path, tmp_path: Path, task: dict[str, Any], changes: dict[str, Any], text: str
) -> None:
    recipe = small_recipe(**changes)
    other = recipe.model_dump(mode="json")
    other["task"] |= task
    job = make_job(tmp_path, Recipe.model_validate(other), inputs={"start": trained / "teacher" / "out"}, workers=0)
    with pytest.raises(StageFailed, match=text):
        teacher.STAGE.run(job)


@pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a graphics card")
def test_a_graphics_card_that_is_not_there_is_named(tmp_path: Path) -> None:
    recipe = small_recipe().model_copy(update={"execution": Execution(device="cuda")})
    with pytest.raises(StageFailed, match=r"execution.device: cuda: this torch .* finds no graphics card"):
        teacher.run(make_job(tmp_path, recipe, workers=0))


def test_a_check_without_a_sequence_plays_those_of_the_evaluation() -> None:
    check = {"every": 2, "trials": 2, "lifting": [4], "pushing": [30], "sequence": []}
    recipe = Recipe.model_validate(
        {"name": "a", "task": {"references": {"use_rg": False}, "scenes": {"push": 0.5}}, "teacher": {"check": check}}
    )
    with closing(teacher.check_of(Specification(recipe, robot_folder("g1")), 0)) as played:
        scripts = [trial.episode.script for trial in played.trials]
    commands = recipe.task.commands
    assert scripts == 2 * [command_script(LIFTING, commands)] + 2 * [command_script(PUSHING, commands)]


def test_a_student_that_was_stopped_and_resumed_is_the_unbroken_one_bit_for_bit(trained: Path, tmp_path: Path) -> None:
    inputs = {"teacher": trained / "teacher" / "out"}
    resumed = stopped_and_resumed(distill.STAGE, tmp_path, small_recipe(), inputs)
    assert resumed.report.lines == ["resumed from its checkpoint at 32 of 64 steps"]  # type: ignore[attr-defined]
    for name in ("student.safetensors", "student.json"):
        assert (tmp_path / "out" / name).read_bytes() == (trained / "distill" / "out" / name).read_bytes(), name
    assert rows(tmp_path / "work") == rows(trained / "distill" / "work")


def test_both_stages_learn_the_same_with_any_number_of_workers(trained: Path, tmp_path: Path) -> None:
    inputs = {"teacher": trained / "teacher" / "out"}
    for stage, network, reads in ((teacher.STAGE, "teacher", None), (distill.STAGE, "student", inputs)):
        job = make_job(tmp_path / stage.name, small_recipe(), inputs=reads, workers=2)
        stage.run(job)
        name = f"{network}.safetensors"
        assert (job.out / name).read_bytes() == (trained / stage.name / "out" / name).read_bytes(), name
        assert rows(job.work) == rows(trained / stage.name / "work")


def test_both_stages_leave_a_policy_its_layout_and_its_curves(trained: Path) -> None:
    for stage, network in (("teacher", "teacher"), ("distill", "student")):
        out = trained / stage / "out"
        load_policy(out)
        assert load_file(out / f"{network}.safetensors")
        about = json.loads((out / f"{network}.json").read_text())
        assert about["layout"]
        assert (out / "figures" / "learning_curves.png").is_file()
        assert len(pd.read_parquet(out / "tables" / "learning_curves.parquet")) == 2
        assert (
            json.loads((out / "summary.json").read_text())["metrics"]["step"]
            == rows(trained / stage / "work")[-1]["step"]
        )
    curriculum = json.loads((trained / "teacher" / "out" / "teacher.json").read_text())["curriculum"]
    assert sum(map(len, curriculum["levels"].values())) == ENVIRONMENTS
    assert (trained / "teacher" / "out" / "teacher_sb3.zip").is_file()


def test_ppo_of_the_students_network_leaves_a_policy_that_needs_nothing_privileged(tmp_path: Path) -> None:
    recipe = small_recipe(history={"length": 5, "frame_features": 4, "latent": 4})
    teacher.STAGE.run(job := make_job(tmp_path, recipe, workers=0))
    policy = load_policy(job.out)
    assert isinstance(policy, StudentPolicy)
    assert policy.network.history == 5
    assert leaves_student(recipe)
    refused = [text for stage in (distill.STAGE, evaluate.STAGE, export.STAGE) for _, text in stage.problems(recipe)]
    assert len(refused) == 1
    assert "nothing is to be distilled" in refused[0]


def test_a_student_that_never_sees_the_object_begins_as_the_sighted_teacher_and_ignores_it(
    trained: Path, tmp_path: Path
) -> None:
    recipe = small_recipe()
    blind = recipe.distill.model_copy(update={"observe_object": False, "learning_rate": 1e-12})
    inputs = {"teacher": trained / "teacher" / "out"}
    job = make_job(tmp_path, recipe.model_copy(update={"distill": blind}), inputs=inputs, workers=0)
    distill.STAGE.run(job)
    network, about = load_network(job.out)
    teacher_network, _ = load_teacher(trained / "teacher" / "out")
    seen = about["layout"]["observation"]
    assert {"joint_position", "arm_reference"} <= {part["name"] for part in seen}
    assert not any(part["name"].startswith("object") for part in seen)
    size = sum(part["size"] for part in seen)
    layout = full_layout(recipe, load_robot(robot_folder("g1")))
    assert size == network.observation < layout.state.size

    torch.manual_seed(0)
    rows = torch.randn(20, layout.size)
    told = rows.clone()
    told[:, size:] = teacher_network.normalizer.mean[size:]
    policy, again = (policy_of(network) for _ in range(2))
    action = policy.act(rows[:, : layout.state.size].numpy(), np.zeros((20, 0), np.float32))
    np.testing.assert_allclose(action, teacher_network(told).numpy(), atol=1e-5)
    rows[:, size:] += 5.0
    np.testing.assert_array_equal(
        again.act(rows[:, : layout.state.size].numpy(), np.zeros((20, 0), np.float32)), action
    )
    mirrored = mirror_tensor(layout.state.mirror, rows[:, : layout.state.size])[:, None, :size]
    np.testing.assert_allclose(
        network(mirrored.repeat(1, about["architecture"]["history"], 1)).numpy(),
        action_mirror(load_robot(robot_folder("g1")))(action),
        atol=1e-5,
    )


def test_only_parts_of_s_priv_can_be_withheld_from_policy_and_teacher() -> None:
    recipe = small_recipe(value_only=("gyro_bias", "push"))
    assert [path for path, _ in teacher.STAGE.problems(recipe)] == ["teacher.value_only"]
    recipe = small_recipe()
    assert not list(teacher.STAGE.problems(recipe))
    settings = recipe.distill.model_copy(update={"withheld": ("encoder_bias", "motor_stength")})
    (path, text), *others = distill.STAGE.problems(recipe.model_copy(update={"distill": settings}))
    assert (path, others) == ("distill.withheld", [])
    assert text.startswith("'motor_stength' is no part of s_priv: object_mass, ")
    assert not list(distill.STAGE.problems(recipe))


def test_both_trained_networks_obey_the_mirror_of_the_robot(trained: Path) -> None:
    robot = load_robot(robot_folder("g1"))
    layout = full_layout(small_recipe(), robot)
    teacher_network, _ = load_teacher(trained / "teacher" / "out")
    student_network, about = load_network(trained / "distill" / "out")
    torch.manual_seed(0)
    rows = 2.0 * torch.randn(40, layout.size)
    histories = 2.0 * torch.randn(40, about["architecture"]["history"], layout.state.size)
    for network, mirror, given in (
        (teacher_network, layout.mirror, rows),
        (student_network, layout.state.mirror, histories),
    ):
        action = network(given)
        mirrored = network(mirror_tensor(mirror, given))
        torch.testing.assert_close(mirrored, mirror_tensor(action_mirror(robot), action), rtol=0, atol=1e-5)


def test_the_teachers_sb3_zip_plays_as_the_teacher_does_without_any_normalisation_around_it(trained: Path) -> None:
    out = trained / "teacher" / "out"
    example = runpy.run_path(str(EXAMPLES / "teacher_in_sb3.py"))
    zipped, own = PPO.load(out / "teacher_sb3.zip", device="cpu"), load_policy(out)
    environment = Environment("lift", small_recipe())
    seen = np.stack([environment.reset(seed=seed)[0] for seed in range(4)])
    state = full_layout(small_recipe(), load_robot(robot_folder("g1"))).state.size
    actions, _ = zipped.predict(seen, deterministic=True)
    np.testing.assert_allclose(actions, own.act(seen[:, :state], seen[:, state:]), rtol=0, atol=1e-6)
    assert abs(seen).max() > 10.0, "what the environment gives is not normalised"
    assert example["hold"](out / "teacher_sb3.zip", environment) > 5


def test_experts_of_every_scene_that_are_one_teacher_make_the_student_of_that_teacher(
    trained: Path, tmp_path: Path
) -> None:
    recipe = changed(small_recipe(), "distill.experts", {"free": "a.yaml", "lift": "b.yaml"})
    folder = trained / "teacher" / "out"
    distill.STAGE.run(make_job(tmp_path, recipe, inputs={"expert/free": folder, "expert/lift": folder}, workers=0))
    left = (tmp_path / "out" / "student.safetensors").read_bytes()
    assert left == (trained / "distill" / "out" / "student.safetensors").read_bytes()
    assert "teacher" not in distill.STAGE.reads(recipe)
    assert {one.named for one in distill.STAGE.borrows(recipe).values()} == {"a.yaml", "b.yaml"}


def test_each_scene_begins_at_the_levels_of_its_own_expert(
    trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = changed(small_recipe(), "distill.experts", {"free": "a.yaml", "lift": "b.yaml"})
    recipe = changed(recipe, "distill.environments", 8)
    inputs, given = {}, []
    for scene, level in (("free", 0.25), ("lift", 0.75)):
        inputs[f"expert/{scene}"] = folder = Path(shutil.copytree(trained / "teacher" / "out", tmp_path / scene))
        about = json.loads((folder / "teacher.json").read_text())
        levels = about["curriculum"]["levels"].values()
        about["curriculum"]["levels"] = {
            name: {axis: [level] for axis in next(iter(levels))} for name in ("free", "lift")
        }
        (folder / "teacher.json").write_text(json.dumps(about))

    def stop(environments: VectorEnv, curriculum: dict[str, Any]) -> None:
        given.append({scene: levels["posture"] for scene, levels in curriculum["levels"].items()})
        raise Interrupted("seen")

    monkeypatch.setattr(VectorEnv, "set_curriculum", stop)
    with pytest.raises(Interrupted):
        distill.STAGE.run(make_job(tmp_path, recipe, inputs=inputs, workers=0))
    assert given == [{"free": [0.25], "lift": [0.75]}]


def test_a_scene_without_an_expert_and_an_expert_without_a_scene_are_refused() -> None:
    recipe = changed(small_recipe(), "distill.experts", {"free": "a.yaml", "push": "b.yaml"})
    assert dict(distill.STAGE.problems(recipe)) == {
        "distill.experts": "the scene lift is played and has no expert; name one for each of ['free', 'lift']",
        "distill.experts.push": "no scene push is played; valid: free, lift",
    }


def test_the_student_of_a_student_begins_as_its_copy(tmp_path: Path) -> None:
    history = {"length": 25, "estimate": True}
    teacher.STAGE.run(made := make_job(tmp_path / "ppo", small_recipe(history=history), workers=0))
    recipe = changed(small_recipe(), "distill.experts", {"free": "a.yaml", "lift": "a.yaml"})
    inputs = {"expert/free": made.out, "expert/lift": made.out}
    distill.STAGE.run(job := make_job(tmp_path / "copy", recipe, inputs=inputs, workers=0))
    first, *_ = rows(job.work)
    assert first["action_rmse"] < 1e-5
    assert first["kl"] < 1.0, "of the standard deviations alone"
    for place, (name, value) in enumerate({"history": 10, "observe_object": False}.items()):
        other = changed(recipe, f"distill.{name}", value)
        with pytest.raises(StageFailed, match=r"this expert's (history has size 25|observation has)"):
            distill.STAGE.run(make_job(tmp_path / str(place), other, inputs=inputs, workers=0))
