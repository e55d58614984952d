"""Pictures of an environment: a camera that follows the robot, and arrows for the forces."""

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import ARROW_RADIUS, COLOURS, forces
from iowbc.sim.rendering.offscreen import Image, Offscreen
from iowbc.sim.simulation import Simulation

VIEW = {"distance": 2.6, "azimuth": 125.0, "elevation": -12.0}
"""View of the camera [m, degrees]."""


class SceneRenderer(Offscreen):
    """Draws one environment of a simulation. Use as a context manager, or `close` it."""

    def __init__(self, simulation: Simulation, env: int = 0, *, width: int = 640, height: int = 480) -> None:
        """See `Offscreen`."""
        self._simulation, self._env = simulation, env
        self._appearance = Appearance(simulation, env)
        super().__init__(self._appearance.model, width=width, height=height, **VIEW)
        self.camera.lookat[:] = self._aim()

    def frame(self) -> Image:
        """The environment as it is now, (height, width, 3)."""
        data = self._appearance.update()
        self.camera.lookat[:] += 0.1 * (self._aim() - self.camera.lookat)
        return self.draw(data, self._draw_forces)

    def _aim(self) -> Array:
        """Camera target: between ground and pelvis, shifted towards the object."""
        state = self._simulation.state
        aim: Array = state.base_position[self._env].copy()
        if state.has_object[self._env]:
            aim[:2] += 0.35 * (state.object_position[self._env, :2] - aim[:2])
        aim[2] *= 0.9
        return aim

    def _draw_forces(self) -> None:
        """Draws an arrow for each force, where there is room for it."""
        scene = self.scene
        for force in forces(self._simulation, self._env):
            if scene.ngeom >= scene.maxgeom:
                return
            geom, arrow = scene.geoms[scene.ngeom], mujoco.mjtGeom.mjGEOM_ARROW.value
            colour = np.array(COLOURS[force.kind], np.float32)
            mujoco.mjv_initGeom(geom, arrow, np.zeros(3), np.zeros(3), np.zeros(9), colour)
            mujoco.mjv_connector(geom, arrow, ARROW_RADIUS, force.start, force.end)
            scene.ngeom += 1
