"""Draws a model into an image without a screen: by EGL on a graphics card, or by OSMesa in software."""

import ctypes.util
import os
import weakref
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from iowbc.errors import NoRenderer

Image = NDArray[np.uint8]

MARGIN = 400
"""Number of geoms reserved for arrows and lines."""
BACKENDS = {"egl": "EGL", "osmesa": "OSMesa"}
"""Backends and their shared libraries."""
CARDS = ("/dev/nvidia0", "/dev/dri/renderD128")


class Offscreen:
    """Images of one size of a model. Use as a context manager, or `close` it."""

    def __init__(
        self, model: Any, *, width: int, height: int, distance: float, azimuth: float, elevation: float
    ) -> None:
        """`distance` [m], `azimuth` (of the view, from the world's x axis), `elevation` [degrees] of the camera."""
        most = model.vis.global_.offwidth, model.vis.global_.offheight
        if width > most[0] or height > most[1]:
            raise ValueError(f"a picture of {width} x {height} pixels is larger than {most[0]} x {most[1]}")
        self._model = model
        self._context = context(width, height)
        self._finalizer = weakref.finalize(self, self._context.free)
        self._pictures = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._pictures)
        self.scene = mujoco.MjvScene(model, model.ngeom + MARGIN)
        self._option, self.camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._option.geomgroup[3:] = 0
        self.camera.distance, self.camera.azimuth, self.camera.elevation = distance, azimuth, elevation
        self._area = mujoco.MjrRect(0, 0, width, height)
        self._image = np.zeros((height, width, 3), np.uint8)

    def draw(self, data: Any, add: Callable[[], None] = lambda: None) -> Image:
        """The model in the state of `data`, (height, width, 3); `add` adds geoms to the scene before it is drawn."""
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model, data, self._option, None, self.camera, mujoco.mjtCatBit.mjCAT_ALL.value, self.scene
        )
        add()
        mujoco.mjr_render(self._area, self.scene, self._pictures)
        mujoco.mjr_readPixels(self._image, None, self._area, self._pictures)
        return self._image[::-1].copy()

    def close(self) -> None:
        self._pictures.free()
        self._finalizer()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def backend() -> str:
    """The backend in `MUJOCO_GL`, which commands pass on as `IOWBC_GL`; else EGL with a graphics card, or OSMesa."""
    asked = os.environ.get("IOWBC_GL", os.environ.get("MUJOCO_GL", "")).strip().lower()
    if asked in BACKENDS:
        if not ctypes.util.find_library(BACKENDS[asked]):
            raise NoRenderer(f"MUJOCO_GL={asked}, but lib{BACKENDS[asked]} is not installed: install or unset it")
        return asked
    if asked not in ("", "glfw", "glx", "enable", "enabled", "on", "true", "1"):
        raise NoRenderer(f"MUJOCO_GL={asked} draws nothing; unset it or set it to one of {', '.join(BACKENDS)}")
    installed = [name for name, library in BACKENDS.items() if ctypes.util.find_library(library)]
    if not installed:
        raise NoRenderer(
            "no library to draw without a screen: install libosmesa6 (`apt-get install libosmesa6`), "
            "or libegl1 and libgl1-mesa-dri, and try again"
        )
    if "egl" in installed and any(Path(card).exists() for card in CARDS):
        return "egl"
    return "osmesa" if "osmesa" in installed else "egl"


def context(width: int, height: int) -> Any:
    """A current OpenGL context; `free` it after use."""
    chosen = backend()
    try:
        made = import_module(f"mujoco.{chosen}").GLContext(width, height)
        made.make_current()
    except Exception as error:
        other = "osmesa" if chosen == "egl" else "egl"
        raise NoRenderer(
            f"drawing with {chosen} failed ({type(error).__name__}: {error}); set MUJOCO_GL={other} and start again"
        ) from error
    return made
