"""Pictures of an environment: a camera that follows the robot, and arrows for the forces."""

import weakref
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from iowbc.sim.rendering.backend import context
from iowbc.sim.simulation import Simulation

Array = NDArray[Any]
Image = NDArray[np.uint8]

METRES_PER_NEWTON = 0.004
ARROW_RADIUS = 0.016
SMALLEST_FORCE = 5.0
"""Weaker forces are not drawn [N]."""
PARTNER, PUSH, GRIP, GROUND = (0.1, 0.6, 0.25, 1), (0.85, 0.1, 0.1, 1), (0.95, 0.55, 0.1, 1), (0.2, 0.4, 0.85, 1)
"""Colours of forces: of the partner, of pushes and impulses, of the object on the hands, of the ground on the feet."""
BESIDE = 0.09
"""Forces on hands and feet are drawn this far outside of them, where the limbs do not hide them [m]."""
MARGIN = 200
"""Room for arrows among the things to draw."""


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
        self._model, self._data = simulation.render_model(env)
        most = self._model.vis.global_.offwidth, self._model.vis.global_.offheight
        if width > most[0] or height > most[1]:
            raise ValueError(f"a picture of {width} x {height} pixels is larger than {most[0]} x {most[1]}")
        self._context = context(width, height)
        self._finalizer = weakref.finalize(self, self._context.free)
        self._pictures = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._pictures)
        self._scene = mujoco.MjvScene(self._model, self._model.ngeom + MARGIN)
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._option.geomgroup[3:] = 0
        self._camera.distance, self._camera.azimuth, self._camera.elevation = distance, azimuth, elevation
        self._camera.lookat[:] = self._aim()
        self._area = mujoco.MjrRect(0, 0, width, height)
        self._image = np.zeros((height, width, 3), np.uint8)

    def frame(self) -> Image:
        """The environment as it is now, (height, width, 3)."""
        self._model, self._data = self._simulation.render_model(self._env)
        follow = 0.1 * (self._aim() - self._camera.lookat)
        self._camera.lookat[:] += follow
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        if self._forces:
            self._draw_forces()
        mujoco.mjr_render(self._area, self._scene, self._pictures)
        mujoco.mjr_readPixels(self._image, None, self._area, self._pictures)
        return self._image[::-1].copy()

    def _aim(self) -> Array:
        """Between the ground and the pelvis, on the side of the object."""
        state = self._simulation.state
        aim: Array = state.base_position[self._env].copy()
        if state.has_object[self._env]:
            aim[:2] += 0.35 * (state.object_position[self._env, :2] - aim[:2])
        aim[2] *= 0.9
        return aim

    def _draw_forces(self) -> None:
        state, env = self._simulation.state, self._env
        outward = BESIDE * state.base_rotation[env, :, 1] * np.array([[1.0], [-1.0]])
        if state.has_object[env]:
            self._arrow(self._simulation.partner_handle(env), state.partner_force[env], PARTNER)
            self._arrow(state.object_position[env], self._simulation.impulse_force(env), PUSH)
            hands = self._simulation.hand_position(env)
            for hand in range(2):
                self._arrow(hands[hand] + outward[hand], state.grip_force[env, hand], GRIP)
        self._arrow(state.base_position[env], state.push_force[env], PUSH)
        for foot in range(2):
            self._arrow(state.foot_position[env, foot] + outward[foot], state.foot_force[env, foot], GROUND)

    def _arrow(self, start: Array, force: Array, colour: tuple[float, ...]) -> None:
        if np.linalg.norm(force) < SMALLEST_FORCE or self._scene.ngeom >= self._scene.maxgeom:
            return
        geom = self._scene.geoms[self._scene.ngeom]
        arrow = mujoco.mjtGeom.mjGEOM_ARROW.value
        mujoco.mjv_initGeom(geom, arrow, np.zeros(3), np.zeros(3), np.zeros(9), np.array(colour, np.float32))
        mujoco.mjv_connector(geom, arrow, ARROW_RADIUS, start, start + METRES_PER_NEWTON * force)
        self._scene.ngeom += 1

    def close(self) -> None:
        """Frees the graphics memory."""
        self._pictures.free()
        self._finalizer()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
