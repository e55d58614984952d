"""The stage `export` from a student on disk to the accepted controller, and its gates."""

import json
import runpy
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_policies import read_golden
from network_watch import watched
from stage_jobs import make_job

from iowbc.deploy.contract import Contract, read_contract, seal
from iowbc.deploy.controller import open_session, run
from iowbc.deploy.exported_folder import CONTRACT, GOLDEN, SETTLE, STEP
from iowbc.errors import ContractBroken, Interrupted, NoDisplay, StageFailed, UsageError
from iowbc.evaluation.exported import run_acceptance
from iowbc.evaluation.play import exported_source, play, require_display
from iowbc.evaluation.play_request import PlayRequest
from iowbc.export import golden
from iowbc.export.graph import ControllerGraph
from iowbc.learning.networks import TeacherNetwork
from iowbc.learning.storage import save_network
from iowbc.pipeline.stage import Job
from iowbc.recipe.evaluation.evaluation import Video
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.stages import export

EXAMPLES = Path(__file__).parents[2] / "examples"
STAND = [{"duration": 0.3, "ramp": 0.0}]


class Still:
    """A policy that leaves the joints at their references."""

    def reset(self, which: Any) -> None:
        del which

    def act(self, observation: Any, privileged: Any) -> Any:
        return np.zeros((len(observation), 15), np.float32)


class Leaning(Still):
    """One that does not."""

    def act(self, observation: Any, privileged: Any) -> Any:
        return super().act(observation, privileged) + np.float32(0.5)


@pytest.fixture(scope="session")
def student(graph: ControllerGraph, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("distilled") / ("d" * 8)
    folder.mkdir()
    architecture = {
        "observation": graph.layout.size,
        "history": graph.student.history,
        "actions": 15,
        "frame_features": 8,
        "latent": 8,
        "hidden": [16],
        "activation": "elu",
        "clip": 10.0,
    }
    save_network(graph.student, architecture, folder, "student", {"layout": {"observation": graph.layout.describe()}})
    return folder


def job(folder: Path, robot: Robot, rg: Path, student: Path, *, stop: bool = False, **settings: Any) -> Job:
    values = {"name": "test", "export": {"golden_steps": 24, "timing_steps": 20, **settings}}
    inputs = {"rg-fit": rg, "distill": student}
    return make_job(folder, Recipe.model_validate(values), inputs=inputs, workers=2, interrupted=lambda: stop)


@pytest.fixture(scope="session")
def done(robot: Robot, rg: Path, student: Path, tmp_path_factory: pytest.TempPathFactory) -> Job:
    acceptance = {"trials": 2, "minimum": 0, "sequence": STAND}
    finished = job(tmp_path_factory.mktemp("export"), robot, rg, student, acceptance=[acceptance])
    export.run(finished)
    return finished


def test_the_folder_holds_all_that_a_robot_needs(done: Job, rg: Path) -> None:
    names = {path.name for path in done.out.iterdir()}
    assert {STEP, SETTLE, CONTRACT, GOLDEN, "recipe.json", "robot", "rg", "summary.json"} <= names
    contract = read_contract(done.out)
    assert contract.sources == {"rg-fit": rg.name, "distill": "d" * 8, "export": done.key}
    assert {STEP, SETTLE, GOLDEN, "recipe.json", "robot/robot.yaml", "rg/feasible.npz"} <= contract.files.keys()
    assert "summary.json" not in contract.files, "a result says nothing of what takes another time each time"


def test_the_folder_depends_on_nothing_outside_of_the_stages_key(done: Job) -> None:
    world = exported_source(done.out).world.recipe
    assert world.task == done.recipe.task
    assert world.teacher == Recipe(name="default").teacher
    assert [segment.duration for segment in world.eval.sequence] == [0.3], "played as it was accepted"


def test_parity_size_and_time_are_in_the_summary(done: Job) -> None:
    metrics = json.loads((done.out / "summary.json").read_text())["metrics"]
    assert 0 <= metrics["parity"] < 1e-5
    assert metrics["target_difference"] < 1e-5
    assert metrics["graph_kB"] > 10
    assert 0 < metrics["step_ms"] <= metrics["step_p99_ms"]
    assert metrics["acceptance_trials"] == 2
    said = " ".join(done.report.lines)  # type: ignore[attr-defined]
    assert f"in {metrics['acceptance_survived']:.0f} of 2 trials" in said
    assert "kept a 4 kg object (lift) for 0.3 s" in said


def test_the_controller_errs_as_the_torch_student_does_on_the_same_trials(done: Job) -> None:
    metrics = json.loads((done.out / "summary.json").read_text())["metrics"]
    assert metrics["errors_differ/0"] < 0.01
    assert "differ from the torch student's by 0.0" in " ".join(done.report.lines)  # type: ignore[attr-defined]


def test_another_policy_errs_otherwise_on_the_same_trials(done: Job) -> None:
    source = exported_source(done.out)
    _, (own,) = run_acceptance(source.world, lambda _: Still(), lambda: False)
    _, (other,) = run_acceptance(source.world, lambda _: Leaning(), lambda: False)
    assert own.differs_from(own) == 0.0
    assert other.differs_from(own) > 0.01


def test_a_control_step_is_timed_with_nothing_that_a_robot_need_not_have(done: Job) -> None:
    program = (
        "import sys; from iowbc.cli import main\n"
        f"try: main(['bench', 'control', {str(done.out)!r}, '--steps', '30'])\n"
        "finally: print(*{'torch', 'mujoco', 'pandas', 'scipy'} & sys.modules.keys(), file=sys.stderr)"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert found.returncode == 0
    assert found.stderr.strip() == ""
    head, _, time, processor = found.stdout.splitlines()
    assert head.endswith("30 control steps of one robot on one thread")
    assert all("ms" in line for line in (time, processor))


def test_golden_vectors_let_another_machine_check_the_graph(done: Job) -> None:
    inputs, outputs = read_golden(done.out / GOLDEN)
    assert len(inputs["command"]) == 24
    sessions = (open_session(done.out / name) for name in (SETTLE, STEP))
    found = golden.played(*(partial(run, session) for session in sessions), inputs)
    assert max(golden.largest_difference(outputs, found).values()) < 1e-5


def test_the_golden_rollout_walks_turns_and_changes_height_and_lean(done: Job) -> None:
    inputs, _ = read_golden(done.out / GOLDEN)
    command = inputs["command"]
    assert abs(command[:, :3]).max(axis=0).min() > 0.05
    assert np.ptp(command[:, 3]) > 0.01
    assert np.ptp(command[:, 4]) > 0.03


def test_the_contract_says_what_each_of_its_entries_means(done: Job) -> None:
    said = json.loads((done.out / CONTRACT).read_text())
    unsaid = {"inputs", "outputs", "sentences"}
    assert {name for name in said if name not in said["sentences"]} <= unsaid
    assert said["sentences"]["references.gait.frequency"]
    assert "kp * (target - position) - kd * velocity" in said["torque"]
    assert said["sensing"]["joint_position"] > 0.0
    assert said["latency"]["object"] == [0.0, 2.0]


def test_examples_run_an_export_without_iowbc(done: Job) -> None:
    source = (EXAMPLES / "plain_mujoco.py").read_text() + (EXAMPLES / "onnx_only.py").read_text()
    assert "import iowbc" not in source
    assert "from iowbc" not in source
    compare = runpy.run_path(str(EXAMPLES / "onnx_only.py"))["largest_difference"]
    assert compare(done.out) < 1e-5
    stand = runpy.run_path(str(EXAMPLES / "plain_mujoco.py"))["stand"]
    assert stand(done.out, 0.2) > 0.6


def test_too_few_survivors_fail_the_stage(robot: Robot, rg: Path, student: Path, tmp_path: Path) -> None:
    long = {"trials": 1, "minimum": 1, "mass": 40.0, "sequence": [{"duration": 4.0, "ramp": 0.0}]}
    with pytest.raises(StageFailed, match=r"in 0 of 1 trials.*train longer"):
        export.run(job(tmp_path, robot, rg, student, acceptance=[long]))


def test_a_graph_that_differs_from_torch_fails_the_stage(robot: Robot, rg: Path, student: Path, tmp_path: Path) -> None:
    with pytest.raises(StageFailed, match=r"parity: output \w+ differs"):
        export.run(job(tmp_path, robot, rg, student, parity_tolerance=1e-30, acceptance=[]))


def test_targets_that_differ_from_the_simulations_fail_the_stage(
    robot: Robot, rg: Path, student: Path, tmp_path: Path
) -> None:
    with pytest.raises(StageFailed, match="joint targets differ by"):
        export.run(job(tmp_path, robot, rg, student, target_tolerance=1e-30, acceptance=[]))


def test_a_privileged_policy_is_not_exported(robot: Robot, rg: Path, tmp_path: Path) -> None:
    (tmp_path / "teacher").mkdir()
    about: dict[str, Any] = {"inputs": 9, "actions": 15, "hidden": [8], "activation": "elu", "clip": 10.0}
    save_network(TeacherNetwork(**about), about, tmp_path / "teacher", "teacher", {})
    with pytest.raises(StageFailed, match="holds no student"):
        export.run(job(tmp_path, robot, rg, tmp_path / "teacher"))


def test_an_interruption_ends_the_stage(robot: Robot, rg: Path, student: Path, tmp_path: Path) -> None:
    with pytest.raises(Interrupted, match="export"):
        export.run(job(tmp_path, robot, rg, student, stop=True))


def test_an_exported_folder_plays_on_its_own(done: Job, tmp_path: Path) -> None:
    film = tmp_path / "out.mp4"
    request = PlayRequest(mass=2.0, sequence=(Segment(duration=0.3, ramp=0.0),), video=film)
    source = exported_source(done.out)
    small = {"eval": source.world.recipe.eval.model_copy(update={"video": Video(width=96, height=64, fps=10)})}
    world = replace(source.world, recipe=source.world.recipe.model_copy(update=small))
    episode, outcome, pictures = play(replace(source, world=world), request)
    assert outcome.ending in ("finished", "fell", "dropped")
    assert episode.duration == pytest.approx(0.3)
    assert 1 <= pictures <= 4
    assert film.stat().st_size > 500
    assert [path.name for path in tmp_path.iterdir()] == ["out.mp4"]


def test_playing_an_exported_folder_tells_nobody(done: Job, tmp_path: Path) -> None:
    program = (
        "from pathlib import Path; from iowbc.evaluation.play import exported_source, play;"
        "from iowbc.evaluation.play_request import PlayRequest; from iowbc.recipe.evaluation.sequences import Segment;"
        f"play(exported_source(Path({str(done.out)!r})), PlayRequest(sequence=(Segment(duration=0.1, ramp=0.0),),"
        f"video=Path({str(tmp_path / 'out.mp4')!r})))"
    )
    with watched(tmp_path / "watch") as watch:
        words = [sys.executable, "-c", program]
        shown = subprocess.run(words, env=watch.environment, capture_output=True, text=True, check=False)
        assert shown.returncode == 0, shown.stderr
        assert watch.contacts() == []


def test_a_damaged_recipe_of_an_export_is_named(done: Job, tmp_path: Path) -> None:
    folder = tmp_path / "export"
    shutil.copytree(done.out, folder)
    for damage in ("{", '{"name": "x", "sofa": 1}', None):
        (folder / "recipe.json").unlink() if damage is None else (folder / "recipe.json").write_text(damage)
        with pytest.raises(ContractBroken, match=r"recipe.json(: SHA-256| missing)"):
            exported_source(folder)


def test_what_cannot_be_played_is_refused_with_what_can(done: Job, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="valid: free, lift"):
        play(exported_source(done.out), PlayRequest(scene="sofa", video=tmp_path / "out.mp4"))
    with pytest.raises(UsageError, match="mp4"):
        PlayRequest(video=tmp_path / "out.gif")


def test_an_interrupted_film_leaves_no_file(done: Job, tmp_path: Path) -> None:
    def interrupt(seconds: float, duration: float) -> None:
        raise Interrupted("stopped")

    with pytest.raises(Interrupted):
        play(exported_source(done.out), PlayRequest(video=tmp_path / "out.mp4"), interrupt)
    assert list(tmp_path.iterdir()) == []


def test_without_a_display_the_viewer_says_what_to_do(done: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(NoDisplay, match="--video"):
        require_display()
    with pytest.raises(NoDisplay):
        play(exported_source(done.out), PlayRequest())


def test_a_world_that_cannot_be_built_is_named(done: Job, tmp_path: Path) -> None:
    """The robot's joints are right and its description is not MuJoCo's: only the simulation notices."""
    folder = Path(shutil.copytree(done.out, tmp_path / "export"))
    text = (folder / "robot" / "g1.xml").read_text()
    (folder / "robot" / "g1.xml").write_text(text.replace("<worldbody>", "<worldbody><sofa/>", 1))
    seal(Contract.model_validate_json((folder / CONTRACT).read_bytes()), folder)
    with pytest.raises(ContractBroken, match=r"cannot be used: .*; export again"):
        play(exported_source(folder), PlayRequest(video=tmp_path / "out.mp4"))
