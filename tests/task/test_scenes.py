"""A scene is a field of `simulation.scenes`; everything that goes by scene knows them all."""

import gymnasium
import pytest

import iowbc.task.gym.registration  # noqa: F401
from iowbc.recipe.simulation.holding import SCENES
from iowbc.recipe.task.joint_references import Grasps
from iowbc.recipe.task.task import SceneShares
from iowbc.task.vector.setup import scene_of


def test_every_scene_has_a_share_a_grasp_and_a_name_for_gymnasium() -> None:
    assert tuple(SceneShares.model_fields) == SCENES
    assert set(Grasps.model_fields) == set(SCENES)
    assert {f"iowbc/{name.capitalize()}-v0" for name in SCENES} <= gymnasium.registry.keys()


@pytest.mark.parametrize("scene", SCENES)
def test_every_scene_can_be_trained_alone(scene: str) -> None:
    assert scene_of(3, SceneShares.only(scene)) == [scene] * 3
