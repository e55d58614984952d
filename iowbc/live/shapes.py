"""The geoms of a model as triangles, a mesh for each body and colour."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import trimesh

from iowbc.arrays import Array
from iowbc.robot import rotations

GEOM = mujoco.mjtGeom
HIDDEN_GROUP = 3
"""First group of geoms that is hidden, as in MuJoCo's own viewer."""
ROUND = 24
"""Segments of a circle."""


@dataclass(frozen=True)
class BodyMesh:
    """Triangles of one colour on a body."""

    body: str
    vertices: Array
    """Body frame, (v, 3) [m]."""
    faces: Array
    """(f, 3)."""
    colour: tuple[float, float, float, float]
    """Red, green, blue, opacity, 0 to 1."""


def looks(model: Any) -> Iterator[BodyMesh]:
    """Meshes that MuJoCo's viewer shows, without the ground."""
    return _merged(model, lambda geom: model.geom_group[geom] < HIDDEN_GROUP)


def collision_shapes(model: Any) -> Iterator[BodyMesh]:
    """The primitive collision shapes, visible or hidden."""
    return _merged(model, lambda geom: model.geom_type[geom] != GEOM.mjGEOM_MESH.value)


def _merged(model: Any, wanted: Callable[[int], bool]) -> Iterator[BodyMesh]:
    chosen: dict[tuple[int, tuple[float, ...]], list[tuple[Array, Array]]] = {}
    for geom in range(model.ngeom):
        if model.geom_type[geom] != GEOM.mjGEOM_PLANE.value and wanted(geom):
            material = model.geom_matid[geom]
            colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
            key = int(model.geom_bodyid[geom]), tuple(round(float(part), 4) for part in colour)
            chosen.setdefault(key, []).append(_triangles(model, geom))
    for (body, colour), parts in chosen.items():
        vertices, faces = trimesh.util.append_faces(*zip(*parts, strict=True))
        yield BodyMesh(model.body(body).name, vertices, faces, colour)  # type: ignore[arg-type]


def _triangles(model: Any, geom: int) -> tuple[Array, Array]:
    """Vertices in the body's frame, and faces."""
    kind, size = GEOM(model.geom_type[geom]), model.geom_size[geom]
    if kind == GEOM.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        faces = model.mesh_face[start : start + model.mesh_facenum[mesh]]
    else:
        made = _primitive(kind, size)
        vertices, faces = np.asarray(made.vertices), np.asarray(made.faces)
    return rotations.rotate(model.geom_quat[geom], vertices) + model.geom_pos[geom], faces


def _primitive(kind: Any, size: Array) -> Any:
    """A shape about the origin; the axis of a capsule or cylinder is z, as in MuJoCo."""
    if kind == GEOM.mjGEOM_BOX:
        return trimesh.creation.box(2.0 * size)
    if kind == GEOM.mjGEOM_CAPSULE:
        return trimesh.creation.capsule(height=2.0 * size[1], radius=size[0], count=[ROUND, ROUND])
    if kind == GEOM.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(radius=size[0], height=2.0 * size[1], sections=ROUND)
    if kind in (GEOM.mjGEOM_SPHERE, GEOM.mjGEOM_ELLIPSOID):
        ball = trimesh.creation.icosphere(subdivisions=2)
        ball.apply_scale(size if kind == GEOM.mjGEOM_ELLIPSOID else size[0])
        return ball
    raise ValueError(f"the viewer in the browser draws no geoms of type {kind.name}")
