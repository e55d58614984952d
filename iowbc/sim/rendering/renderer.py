"""Pictures of an environment: a camera that follows the robot, and arrows for the forces."""

from itertools import pairwise

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import ARROW_RADIUS, COLOURS, forces
from iowbc.sim.rendering.offscreen import Image, Offscreen
from iowbc.sim.simulation import Simulation

LINE_RADIUS = 0.012
"""Of lines on the ground [m]."""


class SceneRenderer(Offscreen):
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
    ) -> None:
        """See `Offscreen`."""
        self._simulation, self._env = simulation, env
        self._appearance = Appearance(simulation, env)
        view = {"distance": distance, "azimuth": azimuth, "elevation": elevation}
        super().__init__(self._appearance.model, width=width, height=height, **view)
        self.lines: list[tuple[Array, tuple[float, ...]]] = []
        """Lines to draw beside: points (k, 3) [m] and a colour (red, green, blue, opacity) each."""
        self.camera.lookat[:] = self._aim()

    def frame(self) -> Image:
        """The environment as it is now, (height, width, 3)."""
        data = self._appearance.update()
        self.camera.lookat[:] += 0.1 * (self._aim() - self.camera.lookat)
        return self.draw(data, self._draw_beside)

    def _aim(self) -> Array:
        """Between the ground and the pelvis, on the side of the object."""
        state = self._simulation.state
        aim: Array = state.base_position[self._env].copy()
        if state.has_object[self._env]:
            aim[:2] += 0.35 * (state.object_position[self._env, :2] - aim[:2])
        aim[2] *= 0.9
        return aim

    def _draw_beside(self) -> None:
        for points, colour in self.lines:
            for start, end in pairwise(points):
                self._connect(mujoco.mjtGeom.mjGEOM_CAPSULE.value, LINE_RADIUS, start, end, colour)
        for force in forces(self._simulation, self._env):
            self._connect(mujoco.mjtGeom.mjGEOM_ARROW.value, ARROW_RADIUS, force.start, force.end, COLOURS[force.kind])

    def _connect(self, kind: int, radius: float, start: Array, end: Array, colour: tuple[float, ...]) -> None:
        """Draws an arrow or a capsule between two points, (3,) [m], where there is room for it."""
        scene = self.scene
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(colour, np.float32))
        mujoco.mjv_connector(geom, kind, radius, start, end)
        scene.ngeom += 1
