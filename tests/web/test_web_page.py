"""The page's controller and simulation in a browser, beside those of Python."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_policies import read_golden
from numpy.typing import NDArray

from iowbc.control.command import nominal_command
from iowbc.control.sensors import Measured
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import GOLDEN, exported_folder
from iowbc.deploy.plausibility import JUMP, TargetGuard
from iowbc.evaluation.exported import exported_world
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.web.page import SOURCE, write_page
from iowbc.web.scenes import begun

pytestmark = pytest.mark.timeout(900)

PERIODS = 50
ASKED = (
    *("style.css", "page.js", "iowbc.js", "contract.json", "scenes.json", "settle.onnx", "step.onnx"),
    *("mujoco.wasm", "onnxruntime.wasm"),
)
"""Everything that a page loads."""
PLAYED = (("free", None), ("lift", None), ("lift", 60.0), ("squeeze", None))
"""Scenes, and the object's mass [kg] where it is not the nominal one; 60 kg slip out of the hands."""
TOLERANCE = 1e-4
"""Of the controller, for which the graph computes in float32."""
PHYSICS = 1e-6
"""How far joints, base and object are from Python's after a second, in rad and m; both compute in float64."""
TRAINED = 1e-5
"""The same of a trained policy, which answers to what differs."""
PUBLISHED = Path(__file__).parents[2] / "runs" / "published"


@pytest.fixture(scope="module")
def page(cache: Path, exported: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    write_page(exported, folder, cache, print)
    return folder


@pytest.fixture(scope="module")
def command(recipe: Recipe) -> NDArray[np.float64]:
    """Walks slowly and turns."""
    return nominal_command(recipe.task.commands) + np.array([0.2, 0.05, 0.1, *[0.0] * 8])


def played(
    exported: Path, robot: Robot, scene: str, mass: float | None, command: NDArray[np.float64]
) -> tuple[NDArray[np.float64], bool]:
    """Positions over a second of Python's own closed loop, (periods, nq), and whether the hands held on."""
    world, controller = exported_world(exported), Controller.load(exported)
    simulation = begun(world, robot, scene, np.nan if mass is None else mass)
    controller.reset(scene=scene)
    positions = []
    for _ in range(PERIODS):
        simulation.target[:] = controller.step(simulation.measured, command).position
        simulation.step()
        positions.append(simulation.worlds[0].qpos[0].copy())
    return np.array(positions), bool(simulation.state.grasped.all())


def golden_targets(exported: Path) -> NDArray[np.float64]:
    """Joint targets of Python's controller over the golden rollout, (steps, joints) [rad]."""
    inputs, _ = read_golden(exported / GOLDEN)
    controller = Controller.load(exported)
    controller.reset(scene="free")
    targets = []
    for step in range(len(inputs["command"])):
        row = {name: values[step : step + 1] for name, values in inputs.items()}
        measured = Measured(**{name: row[name] for name in Measured.__dataclass_fields__ if name in row})
        targets.append(controller.step(measured, row["command"]).position[0])
    return np.array(targets)


def test_a_browser_computes_and_simulates_what_python_does(
    page: Path, exported: Path, robot: Robot, command: NDArray[np.float64], answer_of: Callable[..., Any]
) -> None:
    shutil.copy(Path(__file__).with_name("check.html"), page)
    asked = [{"scene": scene, "mass": mass, "command": command.tolist()} for scene, mass in PLAYED]
    (page / "asked.json").write_text(json.dumps({"played": asked}))
    told = answer_of(page, "check.html")
    assert "error" not in told, told["error"]
    print(f"loaded in {told['loaded']:.0f} ms; largest difference {max(told['largest'].values()):.1e}")
    assert max(told["largest"].values()) < TOLERANCE
    assert {name.partition("/")[2] for name in told["largest"]} == {"action", "target", "support_reference"}
    np.testing.assert_allclose(told["targets"], golden_targets(exported), rtol=0, atol=TOLERANCE)
    for (scene, mass), rollout in zip(PLAYED, told["rollouts"], strict=True):
        expected, held = played(exported, robot, scene, mass, command)
        away = np.abs(np.array(rollout["positions"]) - expected)
        print(f"{scene}: differs by {away.max():.1e} over a second, {rollout['factor']:.2f} x real time")
        assert mass is None or not held
        assert np.abs(expected[-1] - expected[0]).max() > 0.05
        assert away.max() < PHYSICS


@pytest.mark.parametrize("name", ["full", "blind"])
def test_a_published_controller_walks_with_a_box_in_a_browser_as_it_does_in_python(
    name: str,
    cache: Path,
    robot: Robot,
    command: NDArray[np.float64],
    answer_of: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(PUBLISHED)
    monkeypatch.setenv("IOWBC_RUNS", str(tmp_path / "runs"))
    published, page = exported_folder(name), tmp_path / "page"
    write_page(published, page, cache, print)
    shutil.copy(Path(__file__).with_name("check.html"), page)
    asked = [{"scene": "lift", "mass": None, "command": command.tolist()}]
    (page / "asked.json").write_text(json.dumps({"played": asked}))
    told = answer_of(page, "check.html")
    assert "error" not in told, told["error"]
    assert max(told["largest"].values()) < TOLERANCE
    expected, held = played(published, robot, "lift", None, command)
    assert held
    assert np.abs(np.array(told["rollouts"][0]["positions"]) - expected).max() < TRAINED


def test_a_visitor_moves_the_sliders_and_no_other_place_is_asked(page: Path, answer_of: Callable[..., Any]) -> None:
    shutil.copy(Path(__file__).with_name("driven.html"), page)
    told = answer_of(page, "driven.html", drawing=True)
    assert "error" not in told, told["error"]
    assert told["title"] == "test on g1"
    assert "real time" in told["ran"]
    assert told["shown"] == ["0.00 m/s", "0.00 m/s", "0.00 rad/s", "0.72 m", "0.00 rad", "4.00 kg"]
    assert told["lowered"] == "0.60 m"
    assert told["agreement"].startswith("Over the 20 steps")
    assert told["wide"]
    assert {re.sub(r":\d+/", "/", address) for address in told["addresses"]} == {
        f"http://127.0.0.1/{name}" for name in ASKED
    }


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node.js")
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_page_holds_targets_that_jump_as_python_does(share: float) -> None:
    limit, period = 10.0, 0.02
    jump = share * JUMP * limit * period
    guard = TargetGuard(1, np.array([limit]), period)
    guard.passed(np.zeros((1, 1)), np.array([True]), np.zeros((1, 1)))
    _, (reason,) = guard.passed(np.array([[jump]]), np.array([False]), np.zeros((1, 1)))
    script = (
        f"import {{ Guard }} from {json.dumps((SOURCE / 'guard.js').as_uri())};"
        f"const guard = new Guard([{limit}], {period}); guard.passed([0], [0]);"
        f"console.log(guard.passed([{jump}], [0]).held)"
    )
    told = subprocess.run(["node", "--input-type=module", "-e", script], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == str(bool(reason)).lower() == str(share > 1.0).lower()
