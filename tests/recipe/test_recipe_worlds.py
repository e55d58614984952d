"""Every accepted recipe has a world that can be built and stepped, and trials that can be planned."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from iowbc.errors import RecipeError
from iowbc.evaluation.trials.plan import planned_sweeps
from iowbc.pipeline.nested import flattened
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

RANGE = ("low", "high", "nominal")
NUMBERS = {
    path: value
    for path, value in flattened(Recipe(name="default").model_dump(mode="json")).items()
    if path.startswith(("simulation.", "task.")) and type(value) in (int, float) and path.count(".") > 1
    if not any(part.isdecimal() for part in path.split("."))
}
"""Numbers of the world and the task, by dotted path."""


def tree(values: dict[str, Any]) -> dict[str, Any]:
    """Values by dotted path as a tree; a range is given whole."""
    found: dict[str, Any] = {}
    for path, value in values.items():
        *above, name = path.split(".")
        branch = found
        for part in above:
            branch = branch.setdefault(part, {})
        if name in RANGE:
            whole = {end: NUMBERS[".".join((*above, end))] for end in RANGE}
            branch.update(whole | {end: branch[end] for end in RANGE if end in branch})
        branch[name] = value
    return found


@st.composite
def worlds(draw: st.DrawFn) -> dict[str, Any]:
    """A few numbers of a recipe, scaled far beyond what is sensible."""
    paths = draw(st.lists(st.sampled_from(sorted(NUMBERS)), min_size=1, max_size=3, unique=True))
    factors = st.sampled_from([0, -1, 1e-3, 0.5, 2, 1e3, 1e9])
    return {path: type(NUMBERS[path])((NUMBERS[path] or 1) * draw(factors)) for path in paths}


def build(recipe: Recipe) -> None:
    """Builds a world of each kind, steps it, and plans the trials."""
    environment = VectorEnv(Specification(recipe, robot_folder("g1")), num_envs=4, workers=0, seed=0)
    try:
        environment.reset()
        environment.step(np.zeros((4, 15), np.float32))
    finally:
        environment.close()
    assert planned_sweeps(recipe) is not None


@settings(max_examples=50, deadline=None, derandomize=True, database=None)
@given(values=worlds())
def test_every_accepted_recipe_builds_its_world_or_is_refused_with_line_and_key(
    tmp_path_factory: pytest.TempPathFactory, values: dict[str, Any]
) -> None:
    file = tmp_path_factory.mktemp("recipe") / "mine.yaml"
    file.write_text(yaml.safe_dump(tree(values)), encoding="utf-8")
    try:
        recipe = load_recipe(file).recipe
    except RecipeError as error:
        misplaced = [problem for problem in error.problems if not re.match(r".*mine.yaml:\d+|default", problem.place)]
        nameless = [problem for problem in error.problems if not problem.text.startswith("key '")]
    else:
        misplaced = nameless = []
        build(recipe)
    assert misplaced == nameless == []


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("physics: {timestep: 0.003}", "key 'simulation.physics.timestep' = 0.003: 0.003 s does not"),
        ("physics: {timestep: 0.02, foot_time_constant: 0.04}\ntask: {control_frequency: 100}", "take 0.01 s"),
        ("physics: {}\neval: {engine: drake, drake: {timestep: 0.003}}", "key 'eval.drake.timestep' = 0.003: 0.003 s"),
        (
            "physics: {}\neval: {simulation: {physics: {timestep: 0.003}}}",
            "eval.simulation.physics.timestep' = 0.003",
        ),
        (
            "randomization: {sensor_latency: {low: 0, high: 300, nominal: 0}}",
            "key 'simulation.randomization.sensor_latency.high' = 300: should be 0 to longest_latency, 4 periods",
        ),
        ("randomization: {action_latency: {low: -1, high: 1, nominal: 0}}", "action_latency.low' = -1: should be 0 to"),
        ("partner: {delay: {low: 0, high: 3.0e+8, nominal: 0}}", "key 'simulation.partner.delay': should be 0 to 10 s"),
        ("randomization: {ground_friction: {low: -0.3, high: 1, nominal: 0.5}}", "' = -0.3: should be 0 or more"),
    ],
)
def test_a_world_that_cannot_be_built_is_refused_with_line_and_key(tmp_path: Path, text: str, told: str) -> None:
    file: Path = tmp_path / "mine.yaml"
    head, _, tail = text.partition("\n")
    file.write_text(f"simulation:\n  {head}\n{tail}\n")
    with pytest.raises(RecipeError) as caught:
        load_recipe(file)
    assert told in str(caught.value)
