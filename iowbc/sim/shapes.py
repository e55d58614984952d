"""Extent, inertia and triangles of an object, from its shape or from its file."""

import functools
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.errors import UsageError
from iowbc.recipe.beside import MeshFile
from iowbc.recipe.simulation.scene import Object
from iowbc.robot import rotations

SMALLEST, LARGEST = 1e-3, 10.0
"""Smallest and largest extent of a mesh [m]: what two hands can hold or push, with a margin."""
HOLE = 0.55
"""Inner radius of a tyre as a part of its outer one."""
HULL = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
"""A mesh has the mass and inertia of its convex hull, which is the collision shape and always closed."""


@dataclass(frozen=True)
class Shape:
    """A uniform body. Its frame stands at the centre of mass, x forward and z up."""

    low: Array
    """Corner of the box around it with the least coordinates, (3,) [m]."""
    high: Array
    """Corner with the greatest coordinates, (3,) [m]."""
    principal: Array
    """Principal moments of inertia for unit mass, (3,) [m²]."""
    about_axes: Array
    """Moments of inertia about the frame's axes for unit mass, (3,) [m²]."""
    turn: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Quaternion of the principal axes in the frame, (4,)."""
    vertices: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """Vertices of a mesh, (n, 3) [m]."""
    faces: Array = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    """Triangles, by the numbers of their vertices, (m, 3)."""


@functools.cache
def measured(thing: Object) -> Shape:
    """The shape of an object. Raises UsageError for an invalid mesh."""
    if thing.mesh is not None:
        return _of_mesh(thing.mesh, thing.scale)
    half = 0.5 * np.asarray(thing.size)
    inertia = _inertia(thing.shape, *(2.0 * half))
    return Shape(low=-half, high=half, principal=inertia, about_axes=inertia)


def _inertia(shape: str, x: float, y: float, z: float) -> Array:
    """Inertia for unit mass of a uniform box, a ring around x, or a cylinder around z, (3,) [m²]."""
    if shape == "box":
        return np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12.0
    if shape == "cylinder":
        across = x * x / 16.0 + z * z / 12.0
        return np.array([across, across, x * x / 8.0])
    outer = 0.25 * (y + z)
    squares = outer**2 * (1.0 + HOLE**2)
    across = squares / 4.0 + x * x / 12.0
    return np.array([squares / 2.0, across, across])


def _of_mesh(mesh: MeshFile, scale: float) -> Shape:
    """The shape of a file, by MuJoCo: mass and inertia are those of the convex hull, the collision shape."""
    spec = mujoco.MjSpec()
    name = f"mesh{mesh.path[mesh.path.rindex('.') :].lower()}"
    spec.assets = {name: mesh.unpacked()}
    spec.add_mesh(name="mesh", file=name, scale=[scale] * 3, inertia=HULL)
    body = spec.worldbody.add_body(name="object")
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", mass=1.0)
    try:
        model: Any = spec.compile()
    except ValueError as error:
        raise UsageError(
            f"{mesh.path}: no object that MuJoCo can weigh: {error}; it needs triangles that enclose some space"
        ) from None
    turn, principal = model.body_iquat[1].copy(), model.body_inertia[1].copy()
    vertices = rotations.rotate(model.mesh_quat[:1], model.mesh_vert) + model.mesh_pos[0] - model.body_ipos[1]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if not ((high - low).min() >= SMALLEST and (high - low).max() <= LARGEST):
        extent = " x ".join(f"{edge:.3g}" for edge in high - low)
        raise UsageError(f"{mesh.path}: extends over {extent} m; expected {SMALLEST:g} to {LARGEST:g}, see `scale`")
    return Shape(
        low=low,
        high=high,
        principal=principal,
        about_axes=np.square(rotations.matrix(turn)) @ principal,
        turn=turn,
        vertices=vertices,
        faces=model.mesh_face.copy(),
    )
