"""The benchmark measures what it says: the bare loop steps the very states of the vector environment."""

from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from changes import with_changes

from iowbc.benchmarks import simulation
from iowbc.benchmarks.bare_loop import STATE, bare_loops, record
from iowbc.benchmarks.simulation import PARTS, step_breakdown
from iowbc.benchmarks.standing_generator import write_standing_generator
from iowbc.control.command import COMMAND, HEIGHT, PITCH
from iowbc.control.references import ReferenceLayer
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup


@pytest.fixture
def setup(recipe: Recipe, folder: Path) -> Setup:
    return Setup(Specification(with_changes(recipe, {"task.scenes.free": 0.0}), folder), 3, 0)


def test_the_bare_loop_takes_the_course_of_the_environments(setup: Setup) -> None:
    course = record(setup, 0, 3, periods=6)
    size = course.models[0].nq + course.models[0].nv
    for index, model in enumerate(course.models):
        data = mujoco.MjData(model)
        for now, after in zip(course.states[:-1], course.states[1:], strict=True):
            mujoco.mj_setState(model, data, now[index], STATE)
            mujoco.mj_step(model, data, course.substeps)
            reached = np.empty(len(now[index]))
            mujoco.mj_getState(model, data, reached, STATE)
            assert reached[1 : 1 + size] == pytest.approx(after[index, 1 : 1 + size], abs=1e-9)


def test_the_parts_of_a_step_add_up(setup: Setup) -> None:
    parts = step_breakdown(setup, periods=5, rounds=1)
    assert parts.keys() == {*PARTS, "reset"}
    assert all(value > 0.0 for value in parts.values())


def test_the_stand_in_for_a_fitted_generator_keeps_the_default_posture(
    recipe: Recipe, robot: Robot, tmp_path: Path
) -> None:
    write_standing_generator(tmp_path, robot, recipe.rg)
    layer = ReferenceLayer(robot, recipe.task.references, tmp_path)
    rng = np.random.default_rng(0)
    command = layer.clamp(rng.normal(size=(5, len(COMMAND))))
    assert command[:, HEIGHT] == pytest.approx(robot.default_height)
    assert command[:, PITCH] == pytest.approx(0.0, abs=1e-5)
    support = layer.support(rng.normal(size=(5, 14)), command)
    assert support == pytest.approx(np.tile(robot.default_position[robot.support], (5, 1)), abs=1e-6)


def test_a_process_that_fails_ends_the_benchmark_instead_of_blocking_it(setup: Setup, tmp_path: Path) -> None:
    broken = replace(setup, specification=replace(setup.specification, rg=tmp_path / "nothing"))
    with pytest.raises(BrokenProcessPool), bare_loops(broken, [(0, 3)], periods=2):
        pass


@pytest.mark.slow
def test_the_benchmark_prints_its_table_and_returns_its_figures(capsys: pytest.CaptureFixture[str]) -> None:
    figures = simulation.main(Recipe(name="bench"), environments=2, workers=(1,), turns=1)
    assert {"bare_1", "vector_env_1", "ratio_1", "step_physics_ms"} <= figures.keys()
    assert all(np.isfinite(value) for value in figures.values())
    assert "vector environment, 1 worker" in capsys.readouterr().out
