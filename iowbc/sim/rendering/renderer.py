"""Pictures of an environment: a camera that follows the robot, and arrows for the forces."""

from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import ARROW_RADIUS, COLOURS, Force, forces
from iowbc.sim.rendering.offscreen import Image, Offscreen
from iowbc.sim.simulation import Simulation


class SceneRenderer:
    """Draws one environment of a simulation. Use as a context manager, or `close` it."""

    def __init__(
        self,
        simulation: Simulation,
        env: int = 0,
        *,
        width: int = 640,
        height: int = 480,
        distance: float = 2.6,
        azimuth: float = 125.0,
        elevation: float = -12.0,
        forces: bool = True,
    ) -> None:
        """`distance` [m], `azimuth` (of the view, from the world's x axis), `elevation` [degrees] of the camera."""
        self._simulation, self._env, self._forces = simulation, env, forces
        self._appearance = Appearance(simulation, env)
        self._offscreen = Offscreen(
            self._appearance.model,
            width=width,
            height=height,
            distance=distance,
            azimuth=azimuth,
            elevation=elevation,
        )
        self.camera = self._offscreen.camera
        self.camera.lookat[:] = self._aim()

    def frame(self) -> Image:
        """The environment as it is now, (height, width, 3)."""
        data = self._appearance.update()
        self.camera.lookat[:] += 0.1 * (self._aim() - self.camera.lookat)
        return self._offscreen.draw(data, self._draw_forces if self._forces else lambda: None)

    def _aim(self) -> Array:
        """Between the ground and the pelvis, on the side of the object."""
        state = self._simulation.state
        aim: Array = state.base_position[self._env].copy()
        if state.has_object[self._env]:
            aim[:2] += 0.35 * (state.object_position[self._env, :2] - aim[:2])
        aim[2] *= 0.9
        return aim

    def _draw_forces(self) -> None:
        for force in forces(self._simulation, self._env):
            self._arrow(force)

    def _arrow(self, force: Force) -> None:
        scene = self._offscreen.scene
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        arrow = mujoco.mjtGeom.mjGEOM_ARROW.value
        colour = np.array(COLOURS[force.kind], np.float32)
        mujoco.mjv_initGeom(geom, arrow, np.zeros(3), np.zeros(3), np.zeros(9), colour)
        mujoco.mjv_connector(geom, arrow, ARROW_RADIUS, force.start, force.end)
        scene.ngeom += 1

    def close(self) -> None:
        """Frees the graphics memory."""
        self._offscreen.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
