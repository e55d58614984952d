"""This machine: installed versions, and its identity as far as results depend on it."""

import functools
import importlib.metadata
import platform
from collections.abc import Mapping
from socket import gethostname

from iowbc.files import file_digest
from iowbc.pipeline.store.digests import PACKAGE, content_digest

RECORDED_PACKAGES = ("crocoddyl", "mujoco", "numpy", "onnxruntime", "pin", "stable-baselines3", "torch")
"""Versions of these are kept with every artifact."""
CODE_DIGITS = 12
"""Hexadecimal digits of the digest by which machines compare their code."""


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


@functools.cache
def identity() -> Mapping[str, str]:
    """The properties of this machine that results depend on, and its name as `host`: `versions()`, and the digest of
    the package's modules as `code`."""
    sources = sorted(PACKAGE.rglob("*.py"))
    code = content_digest({path.relative_to(PACKAGE).as_posix(): file_digest(path) for path in sources})
    return {"host": gethostname(), **versions(), "code": code[:CODE_DIGITS]}


def mismatch(own: Mapping[str, str], other: Mapping[str, str]) -> str:
    """Differences of another machine from this one, with both values; empty where results would be the same."""
    return "; ".join(
        f"{name} {own.get(name, 'missing')} here, {other.get(name, 'missing')} on {other['host']}"
        for name in sorted((own.keys() | other.keys()) - {"host"})
        if own.get(name) != other.get(name)
    )
