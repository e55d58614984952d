"""This machine: name, boot, installed versions."""

import functools
import importlib.metadata
import platform
import socket
from pathlib import Path

RECORDED_PACKAGES = ("crocoddyl", "mujoco", "numpy", "onnxruntime", "pin", "stable-baselines3", "torch")
"""Versions of these are kept with every artifact."""


def host() -> str:
    """The machine's name."""
    return socket.gethostname()


@functools.cache
def boot() -> str:
    """An identifier that changes when the machine starts anew."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return ""


@functools.cache
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that shape a result."""
    found = {"python": platform.python_version()}
    for name in ("iowbc", *RECORDED_PACKAGES):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
