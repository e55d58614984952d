"""A scene's object, one between the hands or a crate on wheels: its extent, inertia and triangles, by its shape or from
its file, and its parts in a model."""

import functools
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.errors import UsageError
from iowbc.recipe.beside import MeshFile
from iowbc.recipe.simulation.scene import Object, Scene
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.timing import Timing

GROUND_BIT, OBJECT_BIT = 1, 4
HANDS = ("left_hand", "right_hand")
"""Bodies without mass at the grip points, through which all forces between hands and object pass."""
NEGLIGIBLE_MASS = 1e-9
"""Mass [kg] and inertia [kg·m²] of those bodies."""
OFF_CENTRE = [0.001, 0.001, 0.001]
"""Centre of mass before one is drawn [m]; off the centre, because the compiler hard-codes a centred one."""
PALM_CONDIM = 4
"""Palms resist sliding and twisting."""
RING_SEGMENTS = 16
CLEARANCE = 0.06
"""Height of a crate's floor above the ground [m]."""
CARDBOARD = (0.72, 0.53, 0.34, 1.0)
RUBBER = (0.13, 0.13, 0.14, 1.0)
WOOD = (0.62, 0.47, 0.30, 1.0)
PAINTED = (0.24, 0.42, 0.53, 1.0)
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


def add_object(
    spec: Any, robot: Robot, scene: Scene, thing: Object, timing: Timing, *, touched: bool, dressed: bool
) -> None:
    """Body `object` with the scene's nominal mass, its joints, the hands with its grips or the palms that touch it.
    `touched`: links other than the palms may touch it too; `dressed`: with visual geometry."""
    shape = measured(thing)
    inertial = {"mass": thing.mass, "ipos": OFF_CENTRE, "inertia": shape.principal * thing.mass, "iquat": shape.turn}
    place = [0.0, 0.0, CLEARANCE - shape.low[2]]
    body = spec.worldbody.add_body(name="object", pos=place, explicitinertial=True, **inertial)
    by_contact = scene.kind == "push" or scene.grasp.kind == "contact"
    ground_bit = GROUND_BIT if scene.kind == "lift" else 0
    bits = {"contype": OBJECT_BIT if by_contact or touched else 0, "conaffinity": ground_bit}
    look = {"name": "object", "group": 2, "rgba": PAINTED, **bits}
    if thing.shape == "tyre":
        _add_ring(body, thing, bits)
    elif thing.shape == "box":
        colour = WOOD if scene.kind == "push" else CARDBOARD
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=shape.high, **look | {"rgba": colour})
    elif thing.shape == "cylinder":
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[shape.high[0], shape.high[2], 0.0], **look)
    else:
        spec.add_mesh(name="object", uservert=shape.vertices.ravel(), userface=shape.faces.ravel(), inertia=HULL)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object", **look)
    if scene.kind == "push":
        _add_wheels(spec, body, thing, dressed)
    else:
        body.add_freejoint(name="object_joint")
    for name, wrist, offset in zip(HANDS, robot.wrist_bodies, robot.grip_offset, strict=True):
        weightless = {"mass": NEGLIGIBLE_MASS, "inertia": [NEGLIGIBLE_MASS] * 3}
        hand = spec.body(wrist).add_body(name=name, pos=offset, explicitinertial=True, **weightless)
        hand.add_site(name=name, group=4)
        add_force_sensor(spec, name, name, timing.substeps)  # of the force through the hand over a control period
    if by_contact:
        _add_palms(spec, scene)
    else:
        _add_grips(spec, body, scene)


def add_force_sensor(spec: Any, name: str, site: str, kept: int = 0) -> None:
    """A sensor of the force that passes through the body of a site; it keeps the values of `kept` physics steps."""
    force, of_site = mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtObj.mjOBJ_SITE
    spec.add_sensor(name=name, type=force, objtype=of_site, objname=site, nsample=kept)


def _add_grips(spec: Any, body: Any, scene: Scene) -> None:
    """A compliant point connection of each grip; its place on the object is set at each reset."""
    for side, hand, sign in (("left", HANDS[0], 1.0), ("right", HANDS[1], -1.0)):
        site = body.add_site(name=f"object_{side}_grip", pos=[0.0, sign * 0.15, scene.grasp.height], group=4)
        spec.add_equality(
            name=f"{side}_grasp",
            type=mujoco.mjtEq.mjEQ_CONNECT,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name1=hand,
            name2=site.name,
            solref=[scene.grasp.time_constant, 1.0],
        )


def _add_palms(spec: Any, scene: Scene) -> None:
    """A sphere on each hand that touches the object, and nothing else."""
    x, y, z = scene.palm
    for name, hand, sign in (("left_palm", HANDS[0], 1.0), ("right_palm", HANDS[1], -1.0)):
        spec.body(hand).add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[scene.palm_radius, 0.0, 0.0],
            pos=[x, sign * y, z],
            contype=0,
            conaffinity=OBJECT_BIT,
            condim=PALM_CONDIM,
            priority=2,
            friction=[1.0, scene.grasp.torsion, 0.0001],
            rgba=(0.2, 0.2, 0.22, 1.0),
            group=2,
        )


def _add_wheels(spec: Any, body: Any, thing: Object, dressed: bool) -> None:
    """Planar motion and turning; rolling resistance is the dry friction of tendons over these joints."""
    for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0))):
        body.add_joint(name=f"object_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.add_joint(name="object_yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 0.0, 1.0))
    for direction in np.eye(3):
        tendon = spec.add_tendon(frictionloss=1.0)
        for name, part in zip(("object_x", "object_y", "object_yaw"), direction, strict=True):
            tendon.wrap_joint(name, part)
    if not dressed:
        return
    (x, y), z = measured(thing).high[:2], -measured(thing).low[2]
    corner = 0.85 if thing.shape == "box" else 0.6
    for along, across in product((-corner, corner), repeat=2):
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[0.5 * CLEARANCE, 0.0, 0.0],
            pos=[along * x, across * y, -z - 0.5 * CLEARANCE],
            contype=0,
            conaffinity=0,
            rgba=RUBBER,
            group=2,
        )


def _add_ring(body: Any, thing: Object, bits: dict[str, int]) -> None:
    outer = 0.5 * measured(thing).high[1:].sum()
    thickness = 0.5 * outer * (1.0 - HOLE)
    middle = outer - thickness
    angles = np.linspace(0.0, 2.0 * np.pi, RING_SEGMENTS + 1)
    rim = np.stack([np.zeros_like(angles), middle * np.cos(angles), middle * np.sin(angles)], axis=1)
    for start, end in pairwise(rim):
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*start, *end],
            size=[thickness, 0.0, 0.0],
            rgba=RUBBER,
            group=2,
            **bits,
        )
