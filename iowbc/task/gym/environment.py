"""A single environment as a `gymnasium.Env`: the same simulation as in the vector environment."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.task import SceneShares
from iowbc.robot.description import robot_folder
from iowbc.sim.rendering.renderer import SceneRenderer
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.workers import InProcess

Observation = NDArray[np.float32]
RENDER_MODE = "rgb_array"
RATE = 50
"""Default frames per second, one frame per step; each environment sets its recipe's control frequency instead."""


class Environment(gymnasium.Env[Observation, Observation]):  # type: ignore[misc]
    """One robot. Observations are [s_t | s_priv], actions the residual a; difficulty as at `curriculum.fixed_level`."""

    metadata = {"render_modes": [RENDER_MODE], "render_fps": RATE}  # noqa: RUF012 - gymnasium's own attribute

    def __init__(
        self,
        scene: str = "lift",
        recipe: Recipe | None = None,
        robot: Path | None = None,
        rg: Path | None = None,
        render_mode: str | None = None,
    ) -> None:
        """`scene`: one of `simulation.scenes`. `recipe`: defaults without one. `robot`: folder of its description, else
        the recipe's. `rg`: folder of the fitted reference generator; without one θ_S_ref is the default posture."""
        if render_mode not in (None, RENDER_MODE):
            raise ValueError(f"render_mode is None or {RENDER_MODE!r}, got {render_mode!r}")
        recipe = recipe or Recipe(name=scene)
        if scene not in recipe.simulation.scenes.names:
            raise ValueError(f"no scene {scene!r}; the recipe's are: {', '.join(recipe.simulation.scenes.names)}")
        task = recipe.task
        shares = SceneShares.only(scene)
        curriculum = task.curriculum.model_copy(update={"enabled": False})
        task = task.model_copy(update={"scenes": shares, "curriculum": curriculum})
        recipe = recipe.model_copy(update={"task": task})
        self.metadata = self.metadata | {"render_fps": round(task.control_frequency)}
        self.render_mode = render_mode
        self._workers = InProcess(Setup(Specification(recipe, robot or robot_folder(recipe.robot), rg), 1, recipe.seed))
        self.batch, self._buffers = self._workers.batch, self._workers.buffers
        bound = task.action.bound
        self.observation_space = spaces.Box(-np.inf, np.inf, self._buffers["observation"].shape[1:], np.float32)
        self.action_space = spaces.Box(-bound, bound, self._buffers["action"].shape[1:], np.float32)
        self._begun = False
        self._renderer: SceneRenderer | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode; `seed` reseeds all random numbers. `options` is ignored."""
        super().reset(seed=seed)
        if seed is not None or not self._begun:
            self.batch.reset(None if seed is None else np.array([seed], np.uint64))
        self._begun = False
        return self._buffers["observation"][0].copy(), {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step. At an episode's end it returns the terminal observation."""
        self._buffers["action"][0] = action
        self.batch.step()
        self._begun = bool(self._buffers["done"][0])
        truncated = bool(self._buffers["truncated"][0])
        kind = "terminal_observation" if self._begun else "observation"
        reward = float(self._buffers["reward"][0])
        return self._buffers[kind][0].copy(), reward, self._begun and not truncated, truncated, {}

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3), or None without a render mode; after an end it shows the next episode."""
        if self.render_mode is None:
            return None
        if self._renderer is None:
            self._renderer = SceneRenderer(self.batch.simulation, 0)
        return self._renderer.frame()

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
