"""This machine: installed versions, and its identity as far as results depend on it."""

import functools
import importlib.metadata
import platform
from dataclasses import dataclass
from socket import gethostname

from iowbc.files import file_digest
from iowbc.pipeline.store.digests import PACKAGE, content_digest

RECORDED_PACKAGES = ("crocoddyl", "mujoco", "numpy", "onnxruntime", "pin", "stable-baselines3", "torch")
"""Versions of these are kept with every artifact."""
SHOWN = 12
"""Characters of a digest that are shown."""


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


@dataclass(frozen=True)
class Identity:
    """The properties of a machine that results depend on."""

    host: str
    versions: dict[str, str]
    """Versions of Python and of the packages that affect results."""
    code: str
    """Digest of the package's modules."""

    def mismatch(self, other: "Identity") -> str:
        """Differences of another machine from this one, with both values; empty where results would be the same."""
        names = sorted(self.versions.keys() | other.versions.keys())
        found = [
            f"{name} {self.versions.get(name, 'missing')} here, {other.versions.get(name, 'missing')} on {other.host}"
            for name in names
            if self.versions.get(name) != other.versions.get(name)
        ]
        if self.code != other.code:
            found.append(f"code {self.code[:SHOWN]} here, {other.code[:SHOWN]} on {other.host}")
        return "; ".join(found)


def identity() -> Identity:
    return Identity(gethostname(), versions(), _code())


@functools.cache
def _code() -> str:
    sources = sorted(PACKAGE.rglob("*.py"))
    return content_digest({path.relative_to(PACKAGE).as_posix(): file_digest(path) for path in sources})
