"""`examples/step.cpp`, where there are a compiler and onnxruntime's headers."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from iowbc.arrays import Array
from iowbc.deploy.contract import read_contract
from iowbc.deploy.controller import Controller, Measured

ROOT = Path(__file__).parents[2]
EXPORTED = (ROOT / "runs" / "published" / "export").glob("*/step.onnx")
PUBLISHED = {read_contract(graph.parent).recipe: graph.parent for graph in EXPORTED}
HEADER = "onnxruntime_cxx_api.h"
PLACES = ("/usr/local/include", "/usr/local/include/onnxruntime", "/usr/include/onnxruntime")
STEPS = 20


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example, linked to the library in onnxruntime's wheel."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    places = [Path(place) for place in (os.environ.get("ORT_INCLUDE"), *PLACES) if place]
    include = next((place for place in places if (place / HEADER).is_file()), None)
    library = next(Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so.*"), None)
    if compiler is None or include is None or library is None:
        pytest.skip(f"compiler {compiler}, {HEADER} in {include} (set ORT_INCLUDE), library {library}: all are needed")
    folder = tmp_path_factory.mktemp("step")
    (folder / "libonnxruntime.so.1").symlink_to(library)
    words = [compiler, "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-isystem", str(include)]
    words += [str(ROOT / "examples" / "step.cpp"), str(library), f"-Wl,-rpath,{folder}", "-o", str(folder / "step")]
    subprocess.run(words, check=True)
    return folder / "step"


def ran(program: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    quiet = os.environ | {"ORT_DISABLE_TELEMETRY": "1"}
    return subprocess.run([program, *words], capture_output=True, text=True, check=False, env=quiet)


def targets_in_python(folder: Path) -> Array:
    """Of the last step of a robot that stands still in its default posture, (joints,) [rad]."""
    controller, gravity = Controller.load(folder), np.array([[0.0, 0.0, -1.0]])
    controller.reset(scene="free")
    joints, command = controller.robot.default_position[None], np.array([0, 0, 0, 0.72, 0, 0, 0, 0, 0, 0, 0.0])
    still = np.zeros((1, 3))
    measured = Measured(gravity, still, still[:, :1], joints, 0.0 * joints, still, np.eye(1, 4), still, still)
    for step in range(STEPS):
        targets = controller.step(measured, command, measured_at=0.02 * step)
    assert not targets.held.any()
    return targets.position[0]


@pytest.mark.parametrize("recipe", ["full", "blind"])
def test_its_targets_are_those_of_python(program: Path, recipe: str) -> None:
    folder = PUBLISHED[recipe]
    done = ran(program, str(folder), str(STEPS))
    assert (done.returncode, done.stderr) == (0, "")
    targets, timing = done.stdout.splitlines()
    assert np.array(targets.split(), float) == pytest.approx(targets_in_python(folder), abs=1e-5)
    assert re.fullmatch(rf"{STEPS} steps of \d+\.\d+ ms", timing)


def test_a_folder_without_a_graph_is_named(program: Path, tmp_path: Path) -> None:
    done = ran(program, str(tmp_path))
    assert done.returncode == 1
    assert f"{tmp_path}/settle.onnx" in done.stderr
