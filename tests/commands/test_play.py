"""Who plays a stage that is being trained is told so; a film says how far it is."""

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from own_parts import own_part
from rich.console import Console

from iowbc.commands import printed
from iowbc.commands.lookup import named
from iowbc.commands.playable import UNPLANNED, in_training, named_source, planned, whole_source
from iowbc.commands.printed import film_progress
from iowbc.errors import UsageError
from iowbc.evaluation.play import requested_episode
from iowbc.evaluation.play_request import PlayRequest
from iowbc.pipeline.store.artifact import describe
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import Workspace
from iowbc.recipe.recipe import Recipe
from iowbc.report.runs import Run

ROOT = Path(__file__).parents[2]


def test_an_unfinished_training_is_told_and_played_from_its_checkpoint(folder: Path) -> None:
    store = Store(Runs(folder / "runs"))
    assert in_training(store, "new/teacher", None) == ("", None)
    workspace = Workspace(store.runs, "teacher", "f" * 64)
    workspace.begin("new", False, {})
    workspace.progress(42, 100, "")
    workspace.write()
    assert in_training(store, "new/teacher", None) == ("teacher of new was interrupted, 42 % done", None)
    checkpoint = workspace.scratch / "training.checkpoint"
    checkpoint.write_bytes(b"")
    os.utime(checkpoint, 2 * (time.time() - 3600,))
    describe(workspace.root, {"inputs": {}}, "name: new\n")
    told, playable = in_training(store, "new", "teacher")
    assert playable is not None
    assert (playable.world.recipe, playable.policy, playable.key) == (Recipe(name="new"), checkpoint, "f" * 64)
    assert told.startswith("teacher of new was interrupted, 42 % done; this is its checkpoint of 60 min ago")
    assert in_training(store, "new", None) == ("", None)
    assert in_training(store, "second/teacher", None) == ("", None)
    assert in_training(store, "new/distill", None) == ("", None)
    with pytest.raises(UsageError, match="two stages; name one of them"):
        in_training(store, "new/teacher", "distill")


def test_the_checkpoint_of_an_interrupted_training_is_not_preferred_to_a_finished_one(folder: Path) -> None:
    store = Store(Runs(folder / "runs"))
    workspace = Workspace(store.runs, "teacher", "f" * 64)
    workspace.begin("first", False, {})
    (workspace.scratch / "training.checkpoint").write_bytes(b"")
    describe(workspace.root, {"inputs": {}}, "name: first\n")
    assert in_training(store, "first/teacher", None) == ("teacher of first was interrupted", None)
    artifacts = named(store, "first").artifacts
    assert in_training(store, "first", "teacher", Run("first", artifacts, {"name": "first"})) == ("", None)


def test_a_training_without_a_checkpoint_yet_is_told_in_one_sentence(folder: Path) -> None:
    store, console = Store(Runs(folder / "runs")), Console(file=io.StringIO())
    Workspace(store.runs, "teacher", "f" * 64).begin("third", False, {})
    with pytest.raises(UsageError, match=r"^teacher of third was interrupted; there is neither a checkpoint that can"):
        named_source(store, console, "third/teacher", None, None, UNPLANNED)
    assert not console.file.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize(("stage", "history", "told"), [("teacher", None, 1), ("teacher", {}, 0), ("distill", None, 0)])
def test_only_a_policy_that_sees_s_priv_is_played_with_its_parts_in_a_users_file(
    tmp_path: Path, stage: str, history: Any, told: int
) -> None:
    values = Recipe(name="mine").model_dump(mode="json")
    values["teacher"]["history"] = history
    values["task"]["observation"]["own"] = {"mine": own_part(tmp_path)}
    manifest = SimpleNamespace(stage=stage, key="0" * 64)
    artifact: Any = SimpleNamespace(manifest=manifest, ingredients={}, recipe=values, folder=tmp_path)
    assert len(whole_source(Store(Runs(tmp_path)), artifact).world.recipe.task.observation.own) == told


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_film_that_is_terminated_leaves_no_part_of_it(tmp_path: Path, number: signal.Signals) -> None:
    program = (
        "import os, signal\nfrom pathlib import Path\nimport numpy as np\n"
        "from iowbc.commands.process import close_on_termination, leave\n"
        "from iowbc.evaluation.films import written_film\n"
        "signal.signal(signal.SIGINT, leave)\nclose_on_termination()\n"
        "with written_film(Path('x.mp4'), 10) as add:\n"
        "    while not any(Path().glob('.film-*/x.mp4')):\n"
        "        add(np.zeros((32, 32, 3), np.uint8))\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_play_that_is_terminated_leaves_no_part_of_its_film(tmp_path: Path) -> None:
    export = next((Path(__file__).parents[2] / "runs" / "published" / "export").glob("*/step.onnx")).parent
    words = [sys.executable, "-m", "iowbc", "play", str(export), "--video", "x.mp4"]
    playing = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while not any(tmp_path.glob(".film-*/x.mp4")):
        if playing.poll() is not None:
            pytest.skip(f"nothing can be drawn here: {playing.communicate()[1].decode()}")
        time.sleep(0.05)
    playing.terminate()
    _, errors = playing.communicate(timeout=60)
    assert playing.returncode == 130, errors.decode()
    assert list(tmp_path.iterdir()) == []


def test_a_film_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(printed, "INTERVAL", 0.0)
    stream = io.StringIO()
    film_progress(Console(file=stream), Path("box.mp4"))(5.0, 40.0)
    assert stream.getvalue() == "box.mp4: sets up the simulation\nbox.mp4: 5 of 40 s\n"
    silent = io.StringIO()
    film_progress(Console(file=silent), None)(5.0, 40.0)
    assert silent.getvalue() == ""


def test_a_recipe_that_plans_cached_is_played_by_its_own_sequence_and_film_settings(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    own = tmp_path / "own.yaml"
    own.write_text(
        f"extends: {ROOT / 'recipes' / 'full.yaml'}\n"
        "name: own\n"
        "stages: [rg-dataset, rg-fit, teacher, distill, eval]\n"
        "eval:\n"
        "  sequence: [{duration: 2.0, ramp: 0.0}, {duration: 3.0, velocity: [0.3, 0.0, 0.0]}]\n"
        "  video: {width: 96, height: 64}\n"
    )
    store, console = Store(Runs(tmp_path / "runs")), Console(file=io.StringIO())
    plan = planned(store, str(own))
    source = named_source(store, console, str(own), None, "wide_box", plan)
    assert source.policy.parent.name == "distill"
    assert requested_episode(source.world.recipe, PlayRequest()).duration == 5.0
    assert requested_episode(source.world.recipe, PlayRequest(scene="wide_box")).scene == "wide_box"
    assert source.world.recipe.eval.video.width == 96
    with pytest.raises(UsageError, match="did you mean 'wide_box'"):
        named_source(store, console, str(own), None, "wide_bx", plan)
