"""Chains of hinges, many rows at once: vectors fixed to the last body are carried inward, hinge by hinge, to the base.

Rows are last in memory, so that NumPy's loops are long, and a turn about a coordinate axis mixes two components. Ours,
because pinocchio and MuJoCo take one posture at a time and are not on the robot's computer.

An example: a forearm of 0.3 m that turns about y at the end of an upper arm of 0.2 m that turns about z. With both
hinges at a quarter turn its end lies 0.3 m below the elbow, which lies 0.2 m to the left of the shoulder:

    upper = Body("upper", None, position=(0, 0, 0), quaternion=(1, 0, 0, 0), hinge=Hinge(axis=(0, 0, 1), ...), ...)
    lower = Body("lower", "upper", position=(0.2, 0, 0), quaternion=(1, 0, 0, 0), hinge=Hinge(axis=(0, 1, 0), ...), ...)
    chain = Chain([[upper, lower]])                      # one chain
    angle = np.full((2, 1, 1), np.pi / 2)                # hinges, chains, rows
    vectors = np.zeros((3, 3, 1, 1))                     # xyz; two columns of the Jacobian and the point; chains; rows
    vectors[:, 2, 0, 0] = (0.3, 0, 0)                    # the point in the forearm's frame
    chain.carry(angle, vectors, columns=2)
    vectors[:, 2, 0, 0]                                  # (0, 0.2, -0.3): the point in the base's frame
    vectors[:, 0, 0, 0], vectors[:, 1, 0, 0]             # (-0.2, 0, 0), (0, -0.3, 0): its motion with each hinge
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations
from iowbc.robot.mjcf import Body

PLANES = (slice(1, 3), slice(2, None, -2), slice(0, 2))
"""Components that a turn about x, y and z mixes, in the order in which the first turns towards the second."""
SWAPPED = (slice(2, 0, -1), slice(0, 3, 2), slice(1, None, -1))
"""The same in the other order."""


def turn(vectors: Array, axis: int, angle: Array) -> None:
    """Turns vectors (3, k, ...) in place about a coordinate axis by angles (...) [rad]."""
    cosine, sines = cosine_and_sines(angle[None])
    mix(vectors, PLANES[axis], cosine[0], sines[0])


def cosine_and_sines(angle: Array) -> tuple[Array, Array]:
    """What `mix` takes, for angles (m, ...) [rad]: cosines (m, ...), and -sines and sines, (m, 2, 1, ...)."""
    sines = np.empty((len(angle), 2, 1, *angle.shape[1:]))
    np.sin(angle, out=sines[:, 1, 0])
    np.negative(sines[:, 1, 0], out=sines[:, 0, 0])
    return np.cos(angle), sines


def mix(vectors: Array, plane: slice, cosine: Array, sines: Array) -> None:
    """As `turn`, in one of the `PLANES`, from cosines (...) and the pair of -sine and sine, (2, 1, ...)."""
    pair = vectors[plane]
    crossed = pair[::-1] * sines
    pair *= cosine
    pair += crossed


@dataclass(frozen=True)
class Weights:
    """Masses of the bodies of equally long chains."""

    moment: Array
    """First moment of mass of each body in its frame, (hinges, 3, chains, 1) [kg·m]."""
    carried: Array
    """Mass from each body outward, (hinges, chains, 1 or n) [kg]."""


class Chain:
    """Equally long chains side by side, such as two arms."""

    def __init__(self, chains: Sequence[Sequence[Body]]) -> None:
        """`chains`: their bodies from the base outward. A body without a hinge is fixed to the one before it; the last
        has one."""
        links = [_links(chain) for chain in chains]
        self.length = len(links[0])
        self._hinges = [_Hinge.of([link[j] for link in links]) for j in range(self.length)]
        """From the base outward."""
        self._sign = np.stack([hinge.sign for hinge in self._hinges])

    def carry(self, angle: Array, vectors: Array, columns: int = 0, weights: Weights | None = None) -> None:
        """Takes vectors from the last bodies' frames to the bases', in place.

        `angle` (hinges, chains, n) [rad]; `vectors` (3, k, chains, n), of which the last is a point and the others are
        directions. The first `columns` of them, one a hinge, are filled with the point's Jacobian instead.

        With `weights` the last is not a point but a first moment of mass: that of what hangs on the last bodies, to
        which each body on the way adds its own. A point is the moment of a unit mass.
        """
        cosine, sines = cosine_and_sines(np.multiply(angle, self._sign, order="C"))
        vectors[:, :columns] = 0.0
        carried, last = vectors[:, columns:], vectors[:, -1]
        for j in reversed(range(self.length)):
            hinge = self._hinges[j]
            if weights is not None:
                last += weights.moment[j]
            if hinge.before is not None:
                _apply(hinge.before, carried)
            mix(carried, hinge.plane, cosine[j], sines[j])
            if columns:
                np.multiply(last[hinge.swapped], hinge.quarter, out=vectors[hinge.plane, j])
                carried = vectors[:, j:]
            if hinge.after is not None:
                _apply(hinge.after, carried)
            last += hinge.offset if weights is None else weights.carried[j] * hinge.offset

    def fetch(self, angle: Array, points: Array) -> None:
        """Takes points (3, k, chains, n) from the bases' frames to the last bodies', in place; inverse of `carry`."""
        cosine, sines = cosine_and_sines(np.multiply(angle, -self._sign, order="C"))
        for j, hinge in enumerate(self._hinges):
            points -= hinge.offset[:, None]
            if hinge.after is not None:
                _apply(hinge.after.swapaxes(0, 1), points)
            mix(points, hinge.plane, cosine[j], sines[j])
            if hinge.before is not None:
                _apply(hinge.before.swapaxes(0, 1), points)


@dataclass(frozen=True)
class _Hinge:
    """A hinge of each of the chains, with what it takes from the frame of the body that it moves to that before."""

    plane: slice
    """Components that a turn about its coordinate axis mixes."""
    swapped: slice
    """The same in the other order."""
    sign: Array
    """Of its turns about that axis, (chains, 1)."""
    quarter: Array
    """The pair of -sign and sign, (2, chains, 1)."""
    before: Array | None
    """Rotation before the turn, (3, 3, chains), and after it."""
    after: Array | None
    offset: Array
    """Its place in the frame before, (3, chains, 1) [m]."""

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
            plane=PLANES[axis],
            swapped=SWAPPED[axis],
            sign=sign,
            quarter=np.stack([-sign, sign]),
            before=_unless_identity(np.swapaxes(aside, 1, 2)),
            after=_unless_identity(fixed @ aside),
            offset=np.stack([link.position for link in links], axis=-1)[..., None],
        )


def _apply(rotation: Array, vectors: Array) -> None:
    """Multiplies vectors (3, k, chains, n) in place by matrices (3, 3, chains)."""
    vectors[:] = np.einsum("rcs,cksn->rksn", rotation, vectors)


def _unless_identity(rotation: Array) -> Array | None:
    """Matrices (chains, 3, 3) with the chains last, or nothing where they do nothing."""
    return None if np.allclose(rotation, np.eye(3)) else np.moveaxis(rotation, 0, -1).copy()


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
