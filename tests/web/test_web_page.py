"""The page's controller and simulation in a browser, beside those of Python."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from iowbc.control.sensors import Measured
from iowbc.deploy.contract import GOLDEN
from iowbc.deploy.controller import Controller
from iowbc.evaluation.exported import exported_world
from iowbc.export.golden import read_golden
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.web.page import write_page
from iowbc.web.scenes import begun, nominal_command

PERIODS = 50
SCENES = ("free", "lift", "squeeze")
TOLERANCE = 1e-4
"""Of the controller, for which the graph computes in float32."""
PHYSICS = 1e-6
"""How far joints, base and object are from Python's after a second, in rad and m; both compute in float64."""


@pytest.fixture(scope="module")
def page(cache: Path, exported: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    write_page(exported, folder, cache, print)
    return folder


@pytest.fixture(scope="module")
def command(recipe: Recipe) -> NDArray[np.float64]:
    """Walks slowly and turns."""
    return nominal_command(recipe) + np.array([0.2, 0.05, 0.1, *[0.0] * 8])


def played(exported: Path, robot: Robot, scene: str, command: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions over a second of Python's own closed loop, (periods, nq)."""
    simulation, controller = begun(exported_world(exported), robot, scene), Controller.load(exported)
    controller.reset(scene=scene)
    positions = []
    for _ in range(PERIODS):
        simulation.target[:] = controller.step(Measured.of(simulation.measured), command, limit_rates=False).position
        simulation.step()
        positions.append(simulation.worlds[0].qpos[0].copy())
    return np.array(positions)


def golden_targets(exported: Path) -> NDArray[np.float64]:
    """Joint targets of Python's controller over the golden rollout, (steps, joints) [rad]."""
    inputs, _ = read_golden(exported / GOLDEN)
    controller = Controller.load(exported)
    controller.reset(scene="free")
    targets = []
    for step in range(len(inputs["command"])):
        row = {name: values[step : step + 1] for name, values in inputs.items()}
        measured = Measured(**{name: row[name] for name in Measured.__dataclass_fields__ if name in row})
        targets.append(controller.step(measured, row["command"], limit_rates=False).position[0])
    return np.array(targets)


def test_a_browser_computes_and_simulates_what_python_does(
    page: Path, exported: Path, robot: Robot, command: NDArray[np.float64], answer_of: Callable[[Path, str], Any]
) -> None:
    shutil.copy(Path(__file__).with_name("check.html"), page)
    asked = [{"scene": scene, "command": command.tolist()} for scene in SCENES]
    (page / "asked.json").write_text(json.dumps({"played": asked}))
    told = answer_of(page, "check.html")
    assert "error" not in told, told["error"]
    print({name: f"{value:.1e}" for name, value in told["largest"].items()})
    assert max(told["largest"].values()) < TOLERANCE
    assert {name.partition("/")[2] for name in told["largest"]} >= {
        "action",
        "support_target",
        "arm_reference",
        "history",
    }
    np.testing.assert_allclose(told["targets"], golden_targets(exported), rtol=0, atol=TOLERANCE)
    for scene, rollout in zip(SCENES, told["rollouts"], strict=True):
        expected = played(exported, robot, scene, command)
        away = np.abs(np.array(rollout["positions"]) - expected)
        print(scene, [f"{away[k].max():.1e}" for k in (0, 4, 9, 24, 49)], f"{rollout['factor']:.2f} x real time")
        assert np.abs(expected[-1] - expected[0]).max() > 0.05
        assert away.max() < PHYSICS
