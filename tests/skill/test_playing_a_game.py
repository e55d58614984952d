"""A game is filmed to its end, which is the one that the same game has in an evaluation."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import imageio_ffmpeg
import pytest
import torch
from changes import with_changes

from iowbc.arrays import Array
from iowbc.errors import NoDisplay
from iowbc.learning.networks import TeacherNetwork
from iowbc.sim.rendering import appearance
from iowbc.skill.episodes import Plan
from iowbc.skill.game import HUMAN, ROBOT, TransportGame, play_once
from iowbc.skill.lower_layer import Student
from iowbc.skill.single_game import SingleGame, film_game, show_game
from iowbc.task.specification import Specification

PLAN = Plan("lift_doorway", "tugging", known=False, seed=3)


@pytest.fixture
def networks(world: Specification) -> dict[str, TeacherNetwork | None]:
    torch.manual_seed(0)
    robot = TeacherNetwork(44 + 6 * world.recipe.skill.robot.history, 11, [8], "elu", 5.0).requires_grad_(False)
    return {ROBOT: robot, HUMAN: None}


@pytest.fixture
def game(
    world: Specification,
    student: Student,
    networks: dict[str, TeacherNetwork | None],
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[SingleGame]:
    monkeypatch.setattr(appearance, "installed_meshes", lambda robot: iter(()))
    small = {"eval.video": world.recipe.eval.video.model_copy(update={"width": 64, "height": 64, "fps": 5})}
    smaller = Specification(with_changes(world.recipe, small), world.robot)
    with closing(SingleGame(smaller, student, networks, PLAN)) as game:
        yield game


def test_a_film_shows_the_game_to_its_end(
    game: SingleGame,
    world: Specification,
    student: Student,
    networks: dict[str, TeacherNetwork | None],
    tmp_path: Path,
) -> None:
    told: list[float] = []
    film = tmp_path / "game.mp4"
    frames = film_game(game, film, "a game", lambda seconds, longest: told.append(seconds))
    assert frames == imageio_ffmpeg.count_frames_and_secs(str(film))[0] == int(5 * game.seconds) + 1
    assert told[-1] == pytest.approx(game.seconds)
    assert len(game.lines()) == 3  # the path, and a wall on both sides of it
    with closing(TransportGame(world, student, n=1, plans=(PLAN,))) as again:
        figures = play_once(again, networks)
    assert figures[game.ending][0]
    game.reset()  # an ended game has begun another
    assert game.mass == pytest.approx(figures["mass"][0])


def test_a_window_needs_a_display(game: SingleGame, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(NoDisplay, match="--video"):
        show_game(game)


def test_a_game_that_restarts_within_a_decision_feels_the_same_as_a_new_one(game: SingleGame) -> None:
    def felt(steps: int) -> Array:
        for _ in range(steps):
            game.control()
            game.judge()
        return game.batch._hands.felt[0, -1].copy()

    new = felt(game.batch.substeps)
    felt(game.batch.substeps - 1)
    game.reset()
    assert (felt(game.batch.substeps) == new).all()
