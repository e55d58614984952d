"""Chains of hinges, many rows at once: where each hinge is, from the base outward.

Components come first and rows last, so that NumPy's loops are long. Written here: pinocchio and MuJoCo take one posture
at a time and are not on the robot's computer, and the same code is traced into the exported graph.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Constants, namespace, stacked
from iowbc.robot import rotations
from iowbc.robot.mjcf import Body

PLANES = ((1, 2), (2, 0), (0, 1))
"""For turns about x, y and z: the axis that turns first, and that which it turns towards."""


def rotated(rotation: Array, vector: Array) -> Array:
    """R v of matrices (..., 3, 3, chains, n) and vectors (..., 3, chains, n)."""
    return (rotation * vector[..., None, :, :, :]).sum(-3)


def rotated_back(rotation: Array, vector: Array) -> Array:
    """Rᵀ v, shapes as in `rotated`."""
    return (rotation * vector[..., :, None, :, :]).sum(-4)


def crossed(a: Array, b: Array) -> Array:
    """a × b of vectors (3, ...)."""
    return stacked([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def product(first: Array, second: Array) -> Array:
    """Products of matrices (3, 3, chains, n)."""
    return (first[:, :, None] * second).sum(1)


def turn(axis: int, angle: Array) -> Array:
    """Rotations about a coordinate axis by angles (chains, n) [rad], (3, 3, chains, n); NumPy only."""
    (first, second), rotation = PLANES[axis], np.zeros((3, 3, *angle.shape))
    rotation[axis, axis] = 1.0
    rotation[first, first] = rotation[second, second] = np.cos(angle)
    rotation[second, first] = np.sin(angle)
    rotation[first, second] = -rotation[second, first]
    return rotation


@dataclass(frozen=True)
class Frames:
    """The hinges of chains from the base outward, in the frame that the chains hang on."""

    rotation: Array
    """Rotation of the bodies that the hinges move, (hinges, 3, 3, chains, n)."""
    origin: Array
    """(hinges, 3, chains, n) [m]."""
    axis: Array
    """Unit vectors, (hinges, 3, chains, n)."""

    def end(self, point: Array) -> Array:
        """Points (3, chains, n) [m] of the last bodies, in the frame that the chains hang on."""
        return self.origin[-1] + rotated(self.rotation[-1], point)

    def jacobian(self, point: Array) -> Array:
        """Motion of points (3, chains, n) [m] with each hinge, a_j × (p - o_j), (3, hinges, chains, n)."""
        xp = namespace(point)
        return crossed(xp.swapaxes(self.axis, 0, 1), point[:, None] - xp.swapaxes(self.origin, 0, 1))


class Chain(Constants):
    """Equally long chains side by side, such as two arms."""

    def __init__(self, chains: Sequence[Sequence[Body]]) -> None:
        """`chains`: bodies from the base outward; one without a hinge is fixed to the one before. The last has one."""
        links = [_links(chain) for chain in chains]
        self.length = len(links[0])
        self._axis, self._offset, self._turn = (
            np.moveaxis(np.array([[link[part] for link in chain] for chain in links]), 0, -1)[..., None].copy()
            for part in range(3)
        )

    def frames(self, angle: Array, base: Array | None = None) -> Frames:
        """The hinges, for angles (hinges, chains, n) [rad]; `base` (3, 3, chains, n) turns the whole chain."""
        xp, local = namespace(angle), self._local(angle)
        rotation = [local[0] if base is None else product(base, local[0])]
        for hinge in range(1, self.length):
            rotation.append(product(rotation[-1], local[hinge]))
        after = stacked(rotation)
        before = rotated(after[:-1], self._offset[1:])
        first = self._offset[:1] + 0.0 * after[:1, 0] if base is None else rotated(base, self._offset[0])[None]
        origin = xp.cumsum(xp.concatenate([first, before]), 0)
        return Frames(after, origin, rotated(after, self._axis))

    def inward(self, angle: Array, vectors: Array, *, directions: bool = False) -> Array:
        """Points (3, k, n) [m], or directions, of the frame that the chains hang on, in the frames of the last bodies;
        angles as in `frames`."""
        for rotation, offset in zip(self._local(angle), self._offset, strict=True):
            vectors = rotated_back(rotation, vectors if directions else vectors - offset)
        return vectors

    def _local(self, angle: Array) -> Array:
        """Rotation of each body in the frame of the one before, (hinges, 3, 3, chains, n)."""
        xp, by = namespace(angle), angle[:, None, None]
        return self._turn[:, 0] + self._turn[:, 1] * xp.cos(by) + self._turn[:, 2] * xp.sin(by)


def _links(chain: Sequence[Body]) -> list[tuple[Array, Array, Array]]:
    """Of each hinge its axis, (3,), its position in the frame of the hinge before, (3,) [m], and matrices A, B, C,
    (3, 3, 3): it turns the body by A + B cos θ + C sin θ (Rodrigues). Raises ValueError if the last body has none."""
    if chain and chain[-1].hinge is None:
        raise ValueError(f"body {chain[-1].name!r} ends a joint chain but has no hinge; take the body it is fixed to")
    links, position, rotation = [], np.zeros(3), np.eye(3)
    for body in chain:
        position = position + rotation @ body.position
        rotation = rotation @ rotations.matrix(body.quaternion)
        if body.hinge is not None:
            axis, along = body.hinge.axis, np.outer(body.hinge.axis, body.hinge.axis)
            quarter = rotations.axis_matrix(axis, np.asarray(0.5 * np.pi))
            links.append((axis, position, rotation @ np.stack([along, np.eye(3) - along, quarter - along])))
            position, rotation = np.zeros(3), np.eye(3)
    return links
