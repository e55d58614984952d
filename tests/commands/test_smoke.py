"""The smoke recipe runs from its name to its end: all six stages, at the smallest size; here, and on Ray."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from local_nodes import local_nodes
from network_watch import watched
from ray_processes import HEALTH, below, holds_an_actor, kill, kill_a_node, nodes

from iowbc import open_artifact
from iowbc.recipe.recipe import CONTROLLER

UNTRACKED = ("--set", "execution.track=false")
SWEPT = CONTROLLER[: CONTROLLER.index("distill") + 1]
"""Stages of the sweep: all that learn."""
POINTS = 3
PATIENCE = 600.0
"""Seconds that a sweep may take to its first training, and from there to its end."""


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the recipe was run."""
    folder = tmp_path_factory.mktemp("smoke")
    words = [sys.executable, "-m", "iowbc", "run", "smoke", *UNTRACKED]
    with watched(folder / "watch") as watch:
        made = subprocess.run(words, cwd=folder, env=watch.environment, capture_output=True, text=True, check=False)
        assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
        assert watch.contacts() == [], "no process of a run tells anybody"
    return folder


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_smoke_recipe_runs_in_an_empty_folder_and_is_cached_afterwards(smoke: Path) -> None:
    for stage in CONTROLLER:
        assert open_artifact(f"smoke/{stage}", smoke / "runs").metrics
    exported = open_artifact("smoke/export", smoke / "runs").folder
    assert {"step.onnx", "settle.onnx", "contract.json", "golden.npz"} <= {path.name for path in exported.iterdir()}
    words = [sys.executable, "-m", "iowbc", "run", "smoke", *UNTRACKED]
    again = subprocess.run(words, cwd=smoke, capture_output=True, text=True, check=True)
    assert again.stdout.count(": cached") == len(CONTROLLER)


@pytest.mark.slow
def test_a_run_goes_on_without_pictures_and_says_so_once(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "iowbc", "run", "smoke", "--until", "rg-dataset", *UNTRACKED]
    environment = os.environ | {"MUJOCO_GL": "nonsense"}
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert (done.stdout + done.stderr).count("MUJOCO_GL=nonsense draws nothing") == 1


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_sweep_of_it_on_ray_outlives_a_node_with_the_same_results(smoke: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    words = [sys.executable, "-m", "iowbc", "sweep", "smoke", "--set", f"seed=0..{POINTS - 1}", *UNTRACKED]
    words += ["--until", SWEPT[-1], "--set", "execution.copy_files=true", "--set", "execution.rollout_actors=2"]
    words += ["--engine", "ray", "--jobs", str(POINTS), "--address"]
    said = tmp_path / "said.txt"
    with local_nodes([1, 1, 1]) as address, said.open("wb") as output:
        command = [*words, address]
        sweep = subprocess.Popen(command, cwd=tmp_path, env=os.environ | HEALTH, stdout=output, stderr=output)
        outlives_a_node(sweep, said)
    logs = [log.read_text() for log in tmp_path.glob("runs/sweeps/*/logs/*.log")]
    assert any("was lost" in log for log in logs), "the node had work"
    alone, swept = results(smoke), results(tmp_path)
    assert len(swept) == POINTS * len(SWEPT)
    assert {stage for stage, _ in alone.keys() - swept.keys()} == {"eval", "export"}
    for key in alone.keys() & swept.keys():
        assert swept[key] == alone[key], key


def outlives_a_node(sweep: "subprocess.Popen[bytes]", said: Path) -> None:
    """Kills a node on which a rollout actor works, and waits for the end."""
    try:
        limit = time.monotonic() + PATIENCE
        while not (found := [node for node in nodes(os.getpid()) if holds_an_actor(node)]):
            assert sweep.poll() is None, said.read_text()
            assert time.monotonic() < limit, "no training has begun"
            time.sleep(0.1)
        kill_a_node(found[0])
        assert sweep.wait(PATIENCE) == 0, said.read_text()
    finally:
        kill(below(sweep.pid))
        sweep.kill()


def results(folder: Path) -> dict[tuple[str, str], str]:
    """Digests of the stored artifacts, by stage and key."""
    return {
        (path.parts[-3], path.parts[-2]): json.loads(path.read_text())["digest"]
        for path in folder.glob("runs/store/*/*/manifest.json")
    }
