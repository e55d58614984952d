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

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations
from iowbc.robot.mjcf import Body

PLANES = (slice(1, 3), slice(2, None, -2), slice(0, 2))
"""Components that a turn about x, y and z mixes, in the order in which the first turns towards the second."""


def turn(vectors: Array, axis: int, angle: Array) -> None:
    """Turns vectors (3, k, ...) in place about a coordinate axis by angles (...) [rad]."""
    cosine, sines = cosine_and_sines(angle[None])
    mix(vectors, axis, cosine[0], sines[0])


def cosine_and_sines(angle: Array) -> tuple[Array, Array]:
    """What `mix` takes, for angles (m, ...) [rad]: cosines (m, ...), and -sines and sines, (m, 2, 1, ...)."""
    sines = np.empty((len(angle), 2, 1, *angle.shape[1:]))
    np.sin(angle, out=sines[:, 1, 0])
    np.negative(sines[:, 1, 0], out=sines[:, 0, 0])
    return np.cos(angle), sines


def mix(vectors: Array, axis: int, cosine: Array, sines: Array) -> None:
    """As `turn`, from cosines (...) and the pair of -sine and sine, (2, 1, ...)."""
    pair = vectors[PLANES[axis]]
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
        self._axis: list[int] = []
        self._sign = np.ones((self.length, len(chains), 1))
        self._offset = np.empty((self.length, 3, len(chains), 1))
        self._before: list[Array | None] = []
        self._after: list[Array | None] = []
        for j in range(self.length):
            axes = np.stack([link[j].axis for link in links])
            fixed = np.stack([link[j].rotation for link in links])
            axis = int(np.argmax(np.abs(axes[0])))
            aside = np.stack([_turning_to(one, axis) for one in axes])
            if np.allclose(np.abs(axes), np.eye(3)[axis]):
                self._sign[j, :, 0] = axes[:, axis]
                aside[:] = np.eye(3)
            self._axis.append(axis)
            self._offset[j, :, :, 0] = np.stack([link[j].position for link in links], axis=-1)
            self._before.append(_unless_identity(np.swapaxes(aside, 1, 2)))
            self._after.append(_unless_identity(fixed @ aside))
        self._quarter = np.stack([-self._sign, self._sign], axis=1)

    def carry(self, angle: Array, vectors: Array, columns: int = 0, weights: Weights | None = None) -> None:
        """Takes vectors from the last bodies' frames to the bases', in place.

        `angle` (hinges, chains, n) [rad]; `vectors` (3, k, chains, n), of which the last is a point and the others are
        directions. The first `columns` of them, one a hinge, are filled with the point's Jacobian instead.

        With `weights` the last is not a point but a first moment of mass: that of what hangs on the last bodies, to
        which each body on the way adds its own. A point is the moment of a unit mass.
        """
        cosine, sines = cosine_and_sines(np.multiply(angle, self._sign, order="C"))
        vectors[:, :columns] = 0.0
        for j in reversed(range(self.length)):
            axis, plane = self._axis[j], PLANES[self._axis[j]]
            first = min(columns, j + 1)
            carried = vectors[:, first:]
            if weights is not None:
                carried[:, -1] += weights.moment[j]
            _apply(self._before[j], carried)
            mix(carried, axis, cosine[j], sines[j])
            if columns:
                first = j
                np.multiply(vectors[plane, -1][::-1], self._quarter[j], out=vectors[plane, j])
            _apply(self._after[j], vectors[:, first:])
            vectors[:, -1] += self._offset[j] if weights is None else weights.carried[j] * self._offset[j]

    def fetch(self, angle: Array, points: Array) -> None:
        """Takes points (3, k, chains, n) from the bases' frames to the last bodies', in place; inverse of `carry`."""
        cosine, sines = cosine_and_sines(np.multiply(angle, -self._sign, order="C"))
        for j in range(self.length):
            points -= self._offset[j][:, None]
            _apply(_inverse(self._after[j]), points)
            mix(points, self._axis[j], cosine[j], sines[j])
            _apply(_inverse(self._before[j]), points)


def _inverse(rotation: Array | None) -> Array | None:
    return None if rotation is None else rotation.swapaxes(0, 1)


def _apply(rotation: Array | None, vectors: Array) -> None:
    """Multiplies vectors (3, k, chains, n) in place by matrices (3, 3, chains)."""
    if rotation is not None:
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
