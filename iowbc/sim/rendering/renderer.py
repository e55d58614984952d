"""Pictures of an environment: a camera that follows the robot, arrows for the forces, and lines on the ground."""

import itertools
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import ARROW_RADIUS, COLOURS, forces
from iowbc.sim.rendering.offscreen import Image, Offscreen
from iowbc.sim.simulation import Simulation

DISTANCE, ELEVATION = 2.6, -12.0
"""Of the camera [m], [degrees]."""
BESIDE = 100.0
"""Direction of the view from the robot's heading at the start [degrees]: from the right and slightly from the front, so
that a crate does not hide the robot."""
LINE_RADIUS = 0.01
"""Half the thickness of a line [m]."""
Line = tuple[Array, tuple[float, ...]]
"""Points (k, 3) [m], world frame, with the colour of the line through them."""


class SceneRenderer(Offscreen):
    """Draws one environment of a simulation. Use as a context manager, or `close` it."""

    def __init__(
        self, simulation: Simulation, env: int = 0, *, width: int = 640, height: int = 480, lines: Sequence[Line] = ()
    ) -> None:
        self._simulation, self._env, self._lines = simulation, env, lines
        self._appearance = Appearance(simulation, env)
        forward = simulation.state.base_rotation[env, :, 0]
        azimuth = BESIDE + float(np.degrees(np.arctan2(forward[1], forward[0])))
        super().__init__(
            self._appearance.model, width=width, height=height, distance=DISTANCE, azimuth=azimuth, elevation=ELEVATION
        )
        self.camera.lookat[:] = self._aim()

    def frame(self) -> Image:
        """The environment as it is now, (height, width, 3)."""
        data = self._appearance.update()
        self.camera.lookat[:] += 0.1 * (self._aim() - self.camera.lookat)
        return self.draw(data, self._add_marks)

    def _aim(self) -> Array:
        """Camera target: between ground and pelvis, shifted towards the object."""
        state = self._simulation.state
        aim: Array = state.base_position[self._env].copy()
        if state.has_object[self._env]:
            aim[:2] += 0.35 * (state.object_position[self._env, :2] - aim[:2])
        aim[2] *= 0.9
        return aim

    def _add_marks(self) -> None:
        add_lines(self.scene, self._lines)
        for force in forces(self._simulation, self._env):
            arrow = mujoco.mjtGeom.mjGEOM_ARROW.value
            _add_connector(self.scene, arrow, COLOURS[force.kind], ARROW_RADIUS, force.start, force.end)


def add_lines(scene: Any, lines: Sequence[Line]) -> None:
    """Adds the lines to what MuJoCo's scene shows, as far as there is room."""
    for points, colour in lines:
        for ends in itertools.pairwise(points):
            _add_connector(scene, mujoco.mjtGeom.mjGEOM_CAPSULE.value, colour, LINE_RADIUS, *ends)


def _add_connector(scene: Any, kind: int, colour: Sequence[float], radius: float, start: Array, end: Array) -> None:
    if scene.ngeom < scene.maxgeom:
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(colour, np.float32))
        mujoco.mjv_connector(geom, kind, radius, start, end)
        scene.ngeom += 1
