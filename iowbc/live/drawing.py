"""The scene in the browser: the bodies of a model as triangles, forces, support polygon, reference posture, a path."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import trimesh
import viser

from iowbc.arrays import Array
from iowbc.live.drag import Drags
from iowbc.live.track import Moment
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.rendering.forces import ARROW_RADIUS, COLOURS
from iowbc.sim.rendering.renderer import Line

View = tuple[tuple[float, ...], tuple[float, ...]]
VIEW: View = ((1.7, -1.4, 1.2), (0.1, 0.0, 0.6))
"""Initial position and target of a camera [m]."""
GHOST = (0.15, 0.45, 0.95)
GHOST_OPACITY = 0.35
SUPPORT, BALANCE = (60, 170, 90), (210, 40, 40)
ABOVE_GROUND = 0.003
"""Height above the ground of what is drawn on it [m]."""
DOT = 0.025
"""Radius of the mark under the centre of mass [m]."""
FOLLOWING = 0.1
"""Part of the way to the robot that the view follows with each picture."""
LEFT_BEHIND = 1.0
"""Distance beyond which the view jumps to the robot [m]."""
HANDLE, HANDLE_RADIUS = (25, 150, 65), 0.06
"""Colour and radius [m] of the handle that a person takes hold of."""
LINE = 0.02
"""Thickness of lines on the ground [m]."""
GEOM = mujoco.mjtGeom
HIDDEN_GROUP = 3
"""First group of geoms that is hidden, as in MuJoCo's own viewer."""
ROUND = 24
"""Segments of a circle."""
PRIMITIVES: Mapping[Any, Callable[[Array], Any]] = {
    GEOM.mjGEOM_BOX: lambda size: trimesh.creation.box(2.0 * size),
    GEOM.mjGEOM_CAPSULE: lambda size: trimesh.creation.capsule(radius=size[0], height=2.0 * size[1], count=[ROUND] * 2),
    GEOM.mjGEOM_CYLINDER: lambda size: trimesh.creation.cylinder(radius=size[0], height=2.0 * size[1], sections=ROUND),
    GEOM.mjGEOM_SPHERE: lambda size: trimesh.creation.icosphere(2).apply_scale(size[0]),
    GEOM.mjGEOM_ELLIPSOID: lambda size: trimesh.creation.icosphere(2).apply_scale(size),
}
"""Shapes about the origin of a size; the axis of a capsule or cylinder is z, as in MuJoCo."""


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


@dataclass(frozen=True)
class ShownParts:
    """Optional parts of the scene, and whether the view follows the robot."""

    forces: bool = True
    support: bool = True
    reference: bool = False
    collision: bool = False
    follow: bool = True


@dataclass(frozen=True)
class GameMarks:
    """Path, walls and handle of a game, drawn once per model."""

    lines: tuple[Line, ...]
    """The path and its walls."""
    handle: Array
    """The far handle, frame of the object, (3,) [m]."""


class Drawing:
    """The scene of a server. `build` it for a model, then `show` its moments."""

    def __init__(self, server: viser.ViserServer, robot: Robot, view: View = VIEW) -> None:
        server.initial_camera.position, server.initial_camera.look_at = view
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._scene, self._robot = server.scene, robot
        scene = self._scene
        self.drags = Drags()
        self._model: Any = None
        self._at = np.zeros(2)
        self._bodies: dict[int, viser.FrameHandle] = {}
        self._ghosts: dict[int, viser.FrameHandle] = {}
        self._root = scene.add_frame("/world", show_axes=False)
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=True)
        scene.add_grid("/world/ground", infinite_grid=True, cell_size=0.25, section_size=1.0, fade_distance=25.0)
        # Browsers apply poses at once but new shapes late, so shapes are drawn in a frame that moves with the robot.
        self._beneath = scene.add_frame("/world/beneath", show_axes=False)
        self._forces = scene.add_arrows(
            "/world/beneath/forces",
            np.zeros((1, 2, 3)),
            np.zeros((1, 3), np.uint8),
            shaft_radius=ARROW_RADIUS,
            head_radius=2.0 * ARROW_RADIUS,
            head_length=4.0 * ARROW_RADIUS,
        )
        self._newtons = scene.add_label("/world/beneath/newtons", "", anchor="bottom-center")
        self._marks: list[Any] = []
        flat = np.zeros((3, 3)), np.array([[0, 1, 2]])
        self._support = scene.add_mesh_simple(
            "/world/beneath/support", *flat, color=SUPPORT, opacity=0.5, side="double", cast_shadow=False
        )
        self._balance = scene.add_cylinder("/world/balance", radius=DOT, height=ABOVE_GROUND, color=BALANCE)

    def build(self, model: Any, marks: GameMarks | None = None) -> None:
        """Replace the bodies and the marks of a game by those of a model."""
        for handle in [*self._marks, *self._bodies.values(), *self._ghosts.values()]:
            handle.remove()
        self._model = model
        links = set(self._robot.tree.bodies)
        with_looks, primitive = list(looks(model)), list(collision_shapes(model))
        self._bodies = {
            model.body(name).id: self._scene.add_frame(f"/world/bodies/{name}", show_axes=False)
            for name in dict.fromkeys(shape.body for shape in [*with_looks, *primitive])
        }
        self._ghosts = {
            model.body(name).id: self._scene.add_frame(f"/world/reference/{name}", show_axes=False, visible=False)
            for name in dict.fromkeys(shape.body for shape in primitive if shape.body in links)
        }
        self._looks = [self._mesh(f"bodies/{shape.body}/looks{n}", shape) for n, shape in enumerate(with_looks)]
        self._shapes = [self._mesh(f"bodies/{shape.body}/shape{n}", shape) for n, shape in enumerate(primitive)]
        for n, shape in enumerate(primitive):
            if shape.body in links:
                self._mesh(f"reference/{shape.body}/shape{n}", shape, ghost=True)
        self._marks = []
        if marks is not None:
            for n, (points, colour) in enumerate(marks.lines):
                ends, shade = np.stack([points[:-1], points[1:]], axis=1), tuple(round(255 * c) for c in colour[:3])
                self._marks.append(self._scene.add_line_segments(f"/world/path{n}", ends, shade, thickness=LINE))
            grip = self._scene.add_icosphere(
                "/world/bodies/object/handle", HANDLE_RADIUS, color=HANDLE, position=marks.handle
            )
            self.drags.follow(grip, "object")

    def _mesh(self, name: str, shape: BodyMesh, ghost: bool = False) -> viser.MeshHandle:
        handle = self._scene.add_mesh_simple(
            f"/world/{name}",
            shape.vertices,
            shape.faces,
            color=GHOST if ghost else shape.colour[:3],
            opacity=GHOST_OPACITY if ghost else None,
            flat_shading=True,
            cast_shadow=not ghost,
            receive_shadow=not ghost,
        )
        if not ghost:
            self.drags.follow(handle, shape.body)
        return handle

    @property
    def away(self) -> Array:
        """Displacement of the view, which follows the robot, (3,) [m]."""
        return np.array([*self._at, 0.0])

    def show(self, model: Any, moment: Moment, shown: ShownParts, marks: GameMarks | None = None) -> None:
        """Everything as it is at a moment of a model, which is built if it is another one than before."""
        if model is not self._model:
            self.build(model, marks)
        for body, frame in self._bodies.items():
            frame.position, frame.wxyz = moment.bodies[body, :3], moment.bodies[body, 3:]
        for body, frame in self._ghosts.items():
            frame.visible = shown.reference
            if shown.reference:
                frame.position, frame.wxyz = moment.reference[body, :3], moment.reference[body, 3:]
        for handles, visible in ((self._looks, not shown.collision), (self._shapes, shown.collision)):
            for handle in handles:
                handle.visible = visible
        base = moment.bodies[model.body(self._robot.base).id, :2]
        beneath = np.array([*base, 0.0])
        self._beneath.position = beneath
        self._show_forces(moment, beneath, shown.forces)
        self._show_support(moment, beneath, shown.support)
        self._follow(base, shown.follow)

    def _show_forces(self, moment: Moment, beneath: Array, wanted: bool) -> None:
        self._forces.visible = wanted and bool(moment.forces)
        if self._forces.visible:
            ends = np.array([[force.start, force.end] for force in moment.forces])
            self._forces.points = (ends - beneath).astype(np.float32)
            colours = np.array([COLOURS[force.kind][:3] for force in moment.forces])
            self._forces.colors = (255 * colours).astype(np.uint8)
        partner = next((force for force in moment.forces if force.kind == "partner"), None)
        self._newtons.visible = wanted and partner is not None
        if partner is not None:
            self._newtons.text = f"{np.linalg.norm(partner.force):.0f} N"
            self._newtons.position = partner.end - beneath

    def _show_support(self, moment: Moment, beneath: Array, wanted: bool) -> None:
        corners = len(moment.support)
        self._support.visible = wanted and corners > 2
        self._balance.visible = wanted
        lifted = np.array([0.0, 0.0, ABOVE_GROUND])
        self._balance.position = moment.balance + 2.0 * lifted
        if self._support.visible:
            fan = np.arange(1, corners - 1)
            self._support.faces = np.stack([np.zeros_like(fan), fan, fan + 1], axis=1).astype(np.uint32)
            self._support.vertices = (moment.support + lifted - beneath).astype(np.float32)

    def _follow(self, base: Array, wanted: bool) -> None:
        """Moves the world under the cameras, so that each may be turned freely; `base` (2,) [m]."""
        target = base if wanted else np.zeros(2)
        away = target - self._at
        far = np.linalg.norm(away) > LEFT_BEHIND
        self._at += away if far else FOLLOWING * away
        self._root.position = np.array([-self._at[0], -self._at[1], 0.0])


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
    elif kind in PRIMITIVES:
        made = PRIMITIVES[kind](size)
        vertices, faces = np.asarray(made.vertices), np.asarray(made.faces)
    else:
        raise ValueError(f"the viewer in the browser draws no geoms of type {kind.name}")
    return rotations.rotate(model.geom_quat[geom], vertices) + model.geom_pos[geom], faces
