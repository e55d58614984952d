"""Several variants on the same trial, as tiles of one film."""

from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from made_up_trials import trials_of

from iowbc.evaluation.films import Actor, common_trial, film_side_by_side, tiled
from iowbc.evaluation.trials.protocol import Protocol
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder
from iowbc.task.specification import Specification


class Still:
    """Does nothing."""

    def reset(self, which: np.ndarray) -> None:
        pass

    def act(self, observation: np.ndarray, privileged: np.ndarray) -> np.ndarray:
        return np.zeros((len(observation), 15), np.float32)


@pytest.mark.parametrize(("count", "shape"), [(1, (4, 6)), (2, (4, 12)), (3, (8, 12)), (4, (8, 12))])
def test_tiles_stand_in_rows(count: int, shape: tuple[int, int]) -> None:
    frames = [np.full((4, 6, 3), 10 * (place + 1), np.uint8) for place in range(count)]
    picture = tiled(frames)
    assert picture.shape == (*shape, 3)
    assert picture[0, 0, 0] == 10
    assert picture[-1, -1, 0] == (0 if count == 3 else 10 * count)


def test_the_trial_that_is_filmed_is_one_that_all_played() -> None:
    world = Specification(Recipe(name="test"), robot_folder("g1"))
    few, many = trials_of("a", "lifting", {4.0: 5, 8.0: 5}), trials_of("b", "lifting", {0.0: 5, 2.0: 5, 8.0: 5})
    rows = common_trial([Actor(world, Still(), few), Actor(world, Still(), many)])
    assert [(row["variant"], row["mass"], row["trial"]) for row in rows] == [("a", 8.0, 0), ("b", 8.0, 0)]
    other = trials_of("c", "pushing", {30.0: 5})
    assert common_trial([Actor(world, Still(), few), Actor(world, Still(), other)]) == []


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # imageio_ffmpeg leaves pipes of an ended ffmpeg open
def test_the_film_has_all_of_them(tmp_path: Path) -> None:
    recipe = Recipe.model_validate(
        {
            "name": "test",
            "task": {"references": {"use_rg": False}},
            "eval": {
                "trials": 1,
                "batch": 2,
                "sequence": [{"duration": 0.3, "ramp": 0.0}],
                "lifting": {"masses": [2], "partner_shares": [0]},
                "video": {"width": 96, "height": 64, "fps": 10},
            },
        }
    )
    world = Specification(recipe, robot_folder("g1"))
    actor = Actor(world, Still(), Protocol(world, Still(), work=tmp_path, workers=0).run())
    actors = [actor, actor, actor]
    told: list[tuple[float, float]] = []
    film_side_by_side(
        actors,
        common_trial(actors),
        tmp_path / "all.mp4",
        progress=lambda seconds, duration: told.append((seconds, duration)),
    )
    assert [seconds for seconds, _ in told] == sorted(seconds for seconds, _ in told)
    assert told[-1] == pytest.approx((0.9, 0.9), abs=0.05)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "all.mp4"))
    assert next(reader)["size"] == (192, 128)
    reader.close()
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "all.mp4"))[0] >= 2
