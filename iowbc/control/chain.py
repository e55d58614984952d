"""Chains of hinges, many rows at once: where each hinge is, from the base outward.

Components come first and rows last, so that NumPy's loops are long. Ours, because pinocchio and MuJoCo take one posture
at a time and are not on the robot's computer, and because the same lines are traced into the exported graph.

An example: a forearm of 0.3 m that turns about y at the end of an upper arm of 0.2 m that turns about z. With both
hinges at a quarter turn its end lies 0.3 m below the elbow, which lies 0.2 m to the left of the shoulder:

    upper = Body("upper", None, position=(0, 0, 0), quaternion=(1, 0, 0, 0), hinge=Hinge(axis=(0, 0, 1), ...), ...)
    lower = Body("lower", "upper", position=(0.2, 0, 0), quaternion=(1, 0, 0, 0), hinge=Hinge(axis=(0, 1, 0), ...), ...)
    frames = Chain([[upper, lower]]).frames(np.full((2, 1, 1), np.pi / 2))     # angles of hinges, chains, rows
    elbow = frames[-1]
    end = elbow.origin + rotated(elbow.rotation, np.array([0.3, 0, 0])[:, None, None])
    end[:, 0, 0]                                                               # (0, 0.2, -0.3)
    jacobian(frames, end)[:, :, 0, 0]                                          # columns (-0.2, 0, 0), (0, -0.3, 0)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array, Constants, namespace, stacked
from iowbc.robot import rotations
from iowbc.robot.mjcf import Body

Rotation = tuple[Array, Array, Array]
"""A rotation matrix by its columns, each (3, chains, n)."""
Entries = tuple[Array | None, ...]
"""A constant vector: components (chains, 1), None for zero."""
IDENTITY: Rotation = (np.eye(3)[0, :, None, None], np.eye(3)[1, :, None, None], np.eye(3)[2, :, None, None])
PLANES = ((1, 2), (2, 0), (0, 1))
"""Columns that a turn about x, y and z mixes, in the order in which the first turns towards the second."""


@dataclass(frozen=True)
class Frame:
    """A hinge of each chain, in the frame that the chains hang on."""

    origin: Array
    """(3, chains, n) [m]."""
    axis: Array
    """Unit vector, (3, chains, n)."""
    rotation: Rotation
    """Of the body that the hinge moves."""


def rotated(rotation: Rotation, vector: Array) -> Array:
    """R v, (3, chains, n), of vectors (3, chains, n)."""
    turned: Array = rotation[0] * vector[0] + rotation[1] * vector[1] + rotation[2] * vector[2]
    return turned


def rotated_back(rotation: Rotation, vector: Array) -> Array:
    """Rᵀ v, shapes as in `rotated`."""
    turned: Array = stacked([(column * vector).sum(0) for column in rotation])
    return turned


def crossed(a: Array, b: Array) -> Array:
    """a × b of vectors (3, ...)."""
    product: Array = stacked([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    return product


def turned(rotation: Rotation, axis: int, angle: Array) -> Rotation:
    """The rotation followed outward by one about a coordinate axis by angles (chains, n) [rad]."""
    xp = namespace(angle)
    return _mixed(rotation, axis, xp.cos(angle), xp.sin(angle))


def _mixed(rotation: Rotation, axis: int, cosine: Array, sine: Array) -> Rotation:
    columns, (first, second) = list(rotation), PLANES[axis]
    columns[first] = cosine * rotation[first] + sine * rotation[second]
    columns[second] = cosine * rotation[second] - sine * rotation[first]
    return columns[0], columns[1], columns[2]


def combined(rotation: Rotation, entries: Entries) -> Array:
    """R v of a constant vector, (3, chains, n)."""
    parts = [column * entry for column, entry in zip(rotation, entries, strict=True) if entry is not None]
    return sum(parts[1:], parts[0]) if parts else 0.0 * rotation[0]


def entries(vectors: Array) -> Entries:
    """Vectors (3, chains) as entries."""
    return tuple(part[:, None].copy() if part.any() else None for part in vectors)


def jacobian(frames: Sequence[Frame], point: Array) -> Array:
    """Motion of points (3, chains, n) [m] with each hinge, a_j × (p - o_j), (3, hinges, chains, n)."""
    axes, origins = stacked([frame.axis for frame in frames]), stacked([frame.origin for frame in frames])
    xp = namespace(point)
    return crossed(xp.swapaxes(axes, 0, 1), point[:, None] - xp.swapaxes(origins, 0, 1))


class Chain(Constants):
    """Equally long chains side by side, such as two arms."""

    def __init__(self, chains: Sequence[Sequence[Body]]) -> None:
        """`chains`: their bodies from the base outward. A body without a hinge is fixed to the one before it; the last
        has one."""
        links = [_links(chain) for chain in chains]
        self.length = len(links[0])
        self._hinges = tuple(_Hinge.of([link[j] for link in links]) for j in range(self.length))
        self._base = IDENTITY

    def turned(self, axis: int, angle: Array) -> Rotation:
        """The rotation of the base about a coordinate axis by angles (chains, n) [rad]."""
        return turned(self._base, axis, angle)

    def frames(self, angle: Array, base: Rotation | None = None) -> list[Frame]:
        """The hinges from the base outward, for angles (hinges, chains, n) [rad]; `base` turns the whole chain."""
        rows, found = 0.0 * angle[0], list[Frame]()
        first, second, third = base or self._base
        rotation: Rotation = (first + rows, second + rows, third + rows)
        xp = namespace(angle)
        for hinge, cosine, sine in zip(self._hinges, xp.cos(angle), xp.sin(angle), strict=True):
            place = combined(rotation, hinge.offset)
            origin = found[-1].origin + place if found else place
            if hinge.before is not None:
                rotation = _composed(rotation, hinge.before)
            axis = rotation[hinge.axis] if hinge.sign is None else rotation[hinge.axis] * hinge.sign
            rotation = _mixed(rotation, hinge.axis, cosine, sine if hinge.sign is None else sine * hinge.sign)
            if hinge.after is not None:
                rotation = _composed(rotation, hinge.after)
            found.append(Frame(origin, axis, rotation))
        return found


@dataclass(frozen=True)
class _Hinge(Constants):
    """A hinge of each of the chains, with what it adds to the frame before."""

    axis: int
    """The coordinate axis that it turns about, after `before`."""
    sign: Array | None
    """Of its turns about that axis, (chains, 1); None where all are positive."""
    before: tuple[Entries, ...] | None
    """Columns of the constant rotation before the turn; None for none."""
    after: tuple[Entries, ...] | None
    """The same after it."""
    offset: Entries
    """Its place in the frame before [m]."""

    @classmethod
    def of(cls, links: Sequence["_Link"]) -> Self:
        """The hinges of equal rank, one a chain."""
        axes, fixed = np.stack([link.axis for link in links]), np.stack([link.rotation for link in links])
        axis = int(np.argmax(np.abs(axes[0])))
        aside, sign = np.stack([_turning_to(one, axis) for one in axes]), np.ones((len(links), 1))
        if np.allclose(np.abs(axes), np.eye(3)[axis]):
            sign[:, 0] = axes[:, axis]
            aside[:] = np.eye(3)
        return cls(
            axis=axis,
            sign=None if (sign == 1.0).all() else sign,
            before=_unless_identity(fixed @ aside),
            after=_unless_identity(np.swapaxes(aside, 1, 2)),
            offset=entries(np.stack([link.position for link in links], axis=-1)),
        )


def _composed(rotation: Rotation, columns: tuple[Entries, ...]) -> Rotation:
    """The rotation followed outward by a constant one."""
    first, second, third = (combined(rotation, column) for column in columns)
    return first, second, third


def _unless_identity(rotation: Array) -> tuple[Entries, ...] | None:
    """Matrices (chains, 3, 3) as columns, or nothing where they do nothing."""
    if np.allclose(rotation, np.eye(3)):
        return None
    return tuple(entries(rotation[:, :, column].T) for column in range(3))


def _turning_to(direction: Array, axis: int) -> Array:
    """A rotation that brings a coordinate axis to a unit vector that is not opposite to it, (3, 3)."""
    start = np.eye(3)[axis]
    between = rotations.cross(start, direction)
    sine = float(np.linalg.norm(between))
    if sine == 0.0:
        return np.eye(3)
    return np.asarray(rotations.axis_matrix(between / sine, np.arctan2(sine, start @ direction)))


@dataclass(frozen=True)
class _Link:
    """A hinge and its place in the frame of the hinge before."""

    axis: Array
    position: Array
    rotation: Array


def _links(chain: Sequence[Body]) -> list[_Link]:
    """The hinges of a chain. Raises ValueError where the last body has none."""
    if chain and chain[-1].hinge is None:
        raise ValueError(f"body {chain[-1].name!r} ends a joint chain but has no hinge; take the body it is fixed to")
    links, position, rotation = [], np.zeros(3), np.eye(3)
    for body in chain:
        position = position + rotation @ body.position
        rotation = rotation @ rotations.matrix(body.quaternion)
        if body.hinge is not None:
            links.append(_Link(body.hinge.axis, position, rotation))
            position, rotation = np.zeros(3), np.eye(3)
    return links
