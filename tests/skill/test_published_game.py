"""The tasks with the published student: admission, and a film."""

import json
from pathlib import Path

import imageio.v2
import pytest

from iowbc.recipe.evaluation.evaluation import Video
from iowbc.recipe.reading.loading import load_recipe
from iowbc.robot.description import robot_folder
from iowbc.skill.admission import admissions
from iowbc.skill.films import film_game
from iowbc.skill.plan import Plan
from iowbc.skill.student import Student, load_student
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


@pytest.mark.slow
def test_a_game_is_filmed_with_its_path(world: Specification, student: Student, tmp_path: Path) -> None:
    video = Video(width=160, height=128, fps=5, duration=2.0)
    figures = film_game(world, student, Plan("lift_straight", "path", True, seed=1), tmp_path / "game.mp4", video)
    assert figures["task"].tolist() == ["lift_straight"]
    with imageio.v2.get_reader(tmp_path / "game.mp4") as film:
        assert film.count_frames() == 11
        assert film.get_data(5).std() > 10.0
