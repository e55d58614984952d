"""A scene as a plant of Drake, from the numbers of a compiled model: Drake's own reader of MJCF drops some of them."""

from typing import Any

import mujoco
import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    GeometrySet,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    PlanarJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import DiagramBuilder

from iowbc.arrays import Array
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.sim.objects import GROUND_BIT

FREE = mujoco.mjtJoint.mjJNT_FREE.value
MIN_STIFFNESS = 1e-9
"""Stiffness of the actuator that stands for dry friction [N·m/rad]: Drake requires a positive one."""
MOST_FRICTION = 1.9
"""Greatest coefficient of friction that can be reached: a harmonic mean with 1 stays below 2."""
GROUND = 100.0
"""Edge of the cube whose upper side is the ground [m]; Drake's half space warns of what it does not support."""
SLIDING = 3
"""Dimension of a contact that resists sliding alone."""
WHEELED = 3
"""Joints of a crate: along x, along y, and about z."""


class Plant:
    """Bodies, joints, motors, grips and contacts of one environment."""

    def __init__(self, model: Any, settings: Drake) -> None:
        """`model`: the compiled model, with the numbers of one episode."""
        self._model, self.settings = model, settings
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=settings.timestep,
            contact_model="point",
            discrete_contact_approximation=settings.contact,
            stiction_tolerance=settings.stiction,
        )
        self.tree, scene_graph = AddMultibodyPlant(config, builder)
        self.bodies = [self.tree.world_body()]
        """In the order of the model."""
        self.joints: list[Any] = [None]
        """The joint that moves each body."""
        for body in range(1, model.nbody):
            self.bodies.append(self.tree.AddRigidBody(model.body(body).name, _inertia(model, body)))
            self.joints.append(self._add_joint(body))
        self.motors: list[Any] = []
        """Joint of each motor."""
        self.motor_inputs: list[int] = []
        """Place of each motor's torque in the input of the plant."""
        for motor in range(model.nu):
            self._add_motor(motor)
        self.grips = [self._connect(row) for row in range(model.neq)]
        shapes = [self._add_shape(geom) for geom in range(model.ngeom)]
        self.tree.Finalize()
        _exclude(model, scene_graph, shapes)
        self.diagram = builder.Build()

    def _add_joint(self, body: int) -> Any:
        model = self._model
        name, count = model.body(body).name, int(model.body_jntnum[body])
        parent, child = self.bodies[model.body_parentid[body]].body_frame(), self.bodies[body].body_frame()
        place, joint = _pose(model.body_pos[body], model.body_quat[body]), int(model.body_jntadr[body])
        if count == 0:
            return self.tree.AddJoint(WeldJoint(name, parent, child, place))
        if model.jnt_type[joint] == FREE:
            return self.tree.AddJoint(QuaternionFloatingJoint(name, parent, child))
        anchor = RigidTransform(model.jnt_pos[joint])
        before = self.tree.AddFrame(FixedOffsetFrame(f"{name} before", parent, place @ anchor))
        after = self.tree.AddFrame(FixedOffsetFrame(f"{name} after", child, anchor))
        if count == WHEELED:
            return self.tree.AddJoint(PlanarJoint(name, before, after, np.zeros(3)))
        damping = float(model.dof_damping[model.jnt_dofadr[joint]])
        low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.inf, np.inf)
        axis = model.jnt_axis[joint]
        return self.tree.AddJoint(RevoluteJoint(name, before, after, axis, low, high, damping))

    def _add_motor(self, motor: int) -> None:
        """A motor with the inertia of its rotor; dry friction is a second one that brakes with a bounded torque."""
        model = self._model
        hinge = int(model.actuator_trnid[motor, 0])
        joint, speed = self.joints[model.jnt_bodyid[hinge]], int(model.jnt_dofadr[hinge])
        actuator = self.tree.AddJointActuator(model.actuator(motor).name, joint)
        actuator.set_default_rotor_inertia(float(model.dof_armature[speed]))
        self.motors.append(joint)
        self.motor_inputs.append(int(actuator.input_start()))
        friction = float(model.dof_frictionloss[speed])
        if friction > 0.0:
            brake = self.tree.AddJointActuator(f"{model.actuator(motor).name} friction", joint, friction)
            brake.set_controller_gains(PdControllerGains(p=MIN_STIFFNESS, d=friction / self.settings.stiction))

    def _connect(self, row: int) -> Any:
        """The connection of a hand and an object at a site of each."""
        model = self._model
        one, other = model.eq_obj1id[row], model.eq_obj2id[row]
        first, second = self.bodies[model.site_bodyid[one]], self.bodies[model.site_bodyid[other]]
        return self.tree.AddBallConstraint(first, model.site_pos[one], second, model.site_pos[other])

    def _add_shape(self, geom: int) -> list[Any]:
        """The geometries of a geom that touches anything. Drake has no torsional friction: a palm is a ring of spheres,
        whose friction resists twisting with the same lever."""
        model, settings = self._model, self.settings
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            return []
        on_ground = not (model.geom_contype[geom] | model.geom_conaffinity[geom]) & ~GROUND_BIT
        sliding, torsion = model.geom_friction[geom, :2].tolist()
        ring = _ring(model.geom_pos[geom], torsion / sliding) if model.geom_condim[geom] > SLIDING else [np.zeros(3)]
        friction = sliding
        if model.geom_priority[geom] > 0:
            friction = min(sliding, MOST_FRICTION)
            friction /= 2.0 - friction
        stiffness = (settings.ground_stiffness if on_ground else settings.body_stiffness) / len(ring)
        properties = ProximityProperties()
        AddContactMaterial(
            dissipation=settings.dissipation,
            point_stiffness=2.0 * stiffness,
            friction=CoulombFriction(friction, friction),
            properties=properties,
        )
        properties.AddProperty("material", "relaxation_time", settings.relaxation)
        below = -0.5 * GROUND * (model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE)  # the upper side of a cube
        place = _pose(model.geom_pos[geom], model.geom_quat[geom]) @ RigidTransform([0.0, 0.0, below])
        body, shape = self.bodies[model.geom_bodyid[geom]], _shape(model, geom)
        return [
            self.tree.RegisterCollisionGeometry(
                body, RigidTransform(offset) @ place, shape, f"geom{geom} {number}", properties
            )
            for number, offset in enumerate(ring)
        ]


def _ring(outward: Array, radius: float) -> list[Array]:
    """Corners of a triangle around an axis (3,), from its centre [m]."""
    axis = outward / np.linalg.norm(outward)
    first = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return [radius * (np.cos(angle) * first + np.sin(angle) * second) for angle in 2.0 / 3.0 * np.pi * np.arange(3)]


def _exclude(model: Any, scene_graph: Any, shapes: list[list[Any]]) -> None:
    """Excludes collisions of shapes whose contact bits in the model do not match, or whose bodies it excludes."""
    present = [geom for geom, own in enumerate(shapes) if own]
    is_a, touches, body = model.geom_contype, model.geom_conaffinity, model.geom_bodyid.tolist()
    excluded = {frozenset(divmod(pair, 1 << 16)) for pair in model.exclude_signature.tolist()}

    def touch(one: int, other: int) -> bool:
        matching = is_a[one] & touches[other] or is_a[other] & touches[one]
        return bool(matching) and frozenset((body[one], body[other])) not in excluded

    filters = CollisionFilterDeclaration()
    for geom in present:
        apart = [shape for other in present if other > geom and not touch(geom, other) for shape in shapes[other]]
        if apart:
            filters.ExcludeBetween(GeometrySet(shapes[geom]), GeometrySet(apart))
    scene_graph.collision_filter_manager().Apply(filters)


def _inertia(model: Any, body: int) -> Any:
    central = RotationalInertia(*model.body_inertia[body]).ReExpress(_rotation(model.body_iquat[body]))
    return SpatialInertia.MakeFromCentralInertia(float(model.body_mass[body]), model.body_ipos[body], central)


def _shape(model: Any, geom: int) -> Any:
    size, kind = model.geom_size[geom].tolist(), mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        return Box(GROUND, GROUND, GROUND)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return Sphere(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return Capsule(size[0], 2.0 * size[1])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return Cylinder(size[0], 2.0 * size[1])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return Box(*(2.0 * np.array(size)))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        return Convex(model.mesh_vert[first : first + model.mesh_vertnum[mesh]].T.astype(np.float64), "object")
    raise ValueError(f"{model.geom(geom).name}: Drake is not given shapes of type {kind.name}")


def _pose(position: Array, quaternion: Array) -> Any:
    return RigidTransform(_rotation(quaternion), position)


def _rotation(quaternion: Array) -> Any:
    return RotationMatrix(Quaternion(quaternion / np.linalg.norm(quaternion)))
