"""Scenes of the web page's simulation, compared with Python's without a browser."""

import mujoco
import numpy as np
import pytest

from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.web.scenes import FIELDS, web_scenes


def test_the_page_is_told_scenes_that_mujoco_compiles_with_the_values_of_the_simulation(
    recipe: Recipe, robot: Robot
) -> None:
    scenes = web_scenes(Specification(recipe, robot.folder), robot)
    assert {"free", "lift", "squeeze"} <= scenes.keys()
    for told in scenes.values():
        model = mujoco.MjModel.from_xml_string(told["xml"])
        assert model.nq == len(told["start"])
        assert {name: len(values) for name, values in told["fields"].items()} == {
            name: np.size(getattr(model, name)) for name in FIELDS
        }
    lifted, free = (np.sum(scenes[name]["fields"]["body_mass"]) for name in ("lift", "free"))
    assert lifted - free == pytest.approx(recipe.simulation.scenes.lift.object.mass)
