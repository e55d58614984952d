"""What must be the same on the driver and on every node: the versions and the code that decide a result."""

import functools
from dataclasses import dataclass

from iowbc.pipeline.machine import host, versions
from iowbc.pipeline.store.digests import PACKAGE, content_digest, file_digest

SHOWN = 12
"""Characters of a digest that are shown."""


@dataclass(frozen=True)
class Identity:
    """A machine as far as results depend on it."""

    host: str
    versions: dict[str, str]
    """Of Python and of the packages that shape a result."""
    code: str
    """Digest of the package's modules."""

    def mismatch(self, other: "Identity") -> str:
        """How another machine differs from this one, with both values; empty where results would be the same."""
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
    """This machine's."""
    return Identity(host(), versions(), _code())


@functools.cache
def _code() -> str:
    sources = sorted(PACKAGE.rglob("*.py"))
    return content_digest({path.relative_to(PACKAGE).as_posix(): file_digest(path) for path in sources})
