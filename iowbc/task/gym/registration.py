"""Importing this module gives single environments their names: `gymnasium.make("iowbc/Lift-v0")`."""

import gymnasium

SCENES = {"Free": "free", "Lift": "lift", "Tyre": "tyre", "Push": "push"}
"""Scene of each environment, by the name between `iowbc/` and `-v0`."""

for _name, _scene in SCENES.items():
    gymnasium.register(
        f"iowbc/{_name}-v0", entry_point="iowbc.task.gym.environment:Environment", kwargs={"scene": _scene}
    )
