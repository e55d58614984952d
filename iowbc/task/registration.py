"""The names under which `gymnasium.make` finds single environments; gymnasium loads this as a plugin."""

import gymnasium

SCENES = {"Free": "free", "Lift": "lift", "Tyre": "tyre", "Push": "push"}
"""Scene of each environment, by the name between `iowbc/` and `-v0`."""


def register() -> None:
    """Registers `iowbc/Free-v0`, `iowbc/Lift-v0` and the others; may be called twice."""
    for name, scene in SCENES.items():
        known = f"iowbc/{name}-v0"
        if known not in gymnasium.registry:
            gymnasium.register(known, entry_point="iowbc.task.environment:Environment", kwargs={"scene": scene})
