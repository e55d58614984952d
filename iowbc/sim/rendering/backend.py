"""Chooses how to draw without a screen: EGL on a graphics card, OSMesa in software."""

import ctypes.util
import os
from importlib import import_module
from pathlib import Path
from typing import Any

from iowbc.errors import NoRenderer

BACKENDS = {"egl": "EGL", "osmesa": "OSMesa"}
"""Backends and their shared libraries."""
CARDS = ("/dev/nvidia0", "/dev/dri/renderD128")


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
