"""The tasks with the published student are admitted."""

import json
from pathlib import Path

import pytest

from iowbc.recipe.reading.loading import load_recipe
from iowbc.robot.description import robot_folder
from iowbc.skill.admission import admissions
from iowbc.skill.lower_layer import Student, load_student
from iowbc.task.specification import Specification

PUBLISHED = Path("runs/published")


def input_of_skill(stage: str) -> Path:
    """The published artifact of a stage above which every published skill was trained."""
    skill = min((PUBLISHED / "skill").iterdir())
    digest = json.loads((skill / "key.json").read_text())["inputs"][stage]
    found = {json.loads((path / "manifest.json").read_text())["digest"]: path for path in (PUBLISHED / stage).iterdir()}
    return found[digest]


@pytest.fixture(scope="module")
def world() -> Specification:
    recipe = load_recipe("recipes/transport.yaml").recipe
    return Specification(recipe, robot_folder("g1"), input_of_skill("rg-fit")).deployed


@pytest.fixture(scope="module")
def student() -> Student:
    return load_student(input_of_skill("teacher"))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_pair_that_knows_the_path_solves_what_a_robot_alone_and_a_pair_that_ignores_each_other_do_not(
    world: Specification, student: Student
) -> None:
    for task in admissions(world, student, trials=2, workers=2, tasks=("push_corridor", "lift_slalom")):
        assert task.problems == ()
