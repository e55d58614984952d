"""Importing this module registers single environments, one for each scene: `gymnasium.make("iowbc/Lift-v0")`."""

import gymnasium

from iowbc.recipe.simulation.holding import SCENES

for _scene in SCENES:
    gymnasium.register(
        f"iowbc/{_scene.capitalize()}-v0",
        entry_point="iowbc.task.gym.environment:Environment",
        kwargs={"scene": _scene},
    )
