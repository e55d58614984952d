"""The model of a scene: the robot's MJCF with motors and ground, and the scene's object; and indices into it."""

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Indices, as_slice
from iowbc.recipe.simulation.scene import Scene
from iowbc.recipe.simulation.simulation import Physics
from iowbc.robot.description import Robot
from iowbc.sim.objects import GROUND_BIT, HANDS, OBJECT_BIT, add_force_sensor, add_object
from iowbc.sim.timing import Timing

GROUND = "ground"
BASE_LINEAR, BASE_ANGULAR = slice(0, 3), slice(3, 6)
"""Velocities of the base in qvel."""
FORCE, NET_FORCE = 1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, 3
"""Output of MuJoCo's contact sensors: the force alone, summed over all contacts."""
LEG_BITS = (8, 16)
"""Contact bits of left and right leg; each touches the other."""
ARENA = 2 << 20
"""Memory for contacts and constraints of one simulation [bytes]; twenty contacts take a tenth of it."""

NO_ISLANDS = mujoco.mjtDisableBit.mjDSBL_ISLAND.value
"""Robot and object are one constrained system, and looking for separate ones takes 5 % of a step."""

HOLDING = ("wrist", "elbow")
"""Parts of the names of bodies that hold an object."""

INTEGRATORS = {"implicit": mujoco.mjtIntegrator.mjINT_IMPLICITFAST, "explicit": mujoco.mjtIntegrator.mjINT_EULER}
"""MuJoCo's implicit integrator takes the motors' velocity feedback into its step; under Euler it is a force computed
from the state before the step, like that of a controller on the robot."""
SOLVERS = {"newton": mujoco.mjtSolver.mjSOL_NEWTON, "cg": mujoco.mjtSolver.mjSOL_CG}
CONES = {"pyramidal": mujoco.mjtCone.mjCONE_PYRAMIDAL, "elliptic": mujoco.mjtCone.mjCONE_ELLIPTIC}


def scene_spec(robot: Robot, physics: Physics, scene: Scene, timing: Timing, *, dressed: bool) -> Any:
    """The editable description, `dressed` with visual geometry, or only what moves or touches. Constraints are solved
    with sparse Jacobians: the same trajectories to rounding, in 5 to 10 % less time."""
    spec = mujoco.MjSpec.from_file(str(robot.mjcf))
    option = spec.option
    option.timestep = physics.timestep
    option.integrator = INTEGRATORS[physics.pd]
    option.solver, option.cone = SOLVERS[physics.solver], CONES[physics.cone]
    option.disableflags |= NO_ISLANDS
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    option.iterations, option.ls_iterations = physics.iterations, physics.line_search_iterations
    if scene.kind == "lift" and scene.grasp.kind == "contact":
        option.cone, option.noslip_iterations = mujoco.mjtCone.mjCONE_ELLIPTIC, scene.grasp.settling
    spec.memory = ARENA
    foot_points = [geom for geom in spec.geoms if geom.parent.name in robot.sole_bodies and geom.conaffinity]
    chains = [robot.tree.chain(sole, robot.base) for sole in robot.sole_bodies]
    legs = {body.name: side for side, chain in enumerate(chains) for body in chain}
    for geom in list(spec.geoms):
        if geom in foot_points:
            geom.priority, geom.solref = 1, [physics.foot_time_constant, 1.0]
            continue
        shape = bool(geom.contype) or geom.parent.name in robot.sole_bodies
        geom.contype, geom.conaffinity = _touches(geom, shape, physics.body_contact)
        if physics.leg_contact and shape and geom.parent.name in legs:
            own = legs[geom.parent.name]
            geom.contype, geom.conaffinity = geom.contype | LEG_BITS[own], geom.conaffinity | LEG_BITS[1 - own]
    if not dressed:
        for geom in [geom for geom in spec.geoms if not (geom.contype or geom.conaffinity)]:
            spec.delete(geom)
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(name=GROUND, type=plane, size=[0, 0, 1], contype=GROUND_BIT, conaffinity=0)
    _add_motors(spec, robot, timing)
    if scene.object is not None:
        touched = physics.body_contact != "nothing"
        add_object(spec, robot, scene, scene.object, timing, touched=touched, dressed=dressed)
    add_force_sensor(spec, "contact_forces", robot.soles[0])
    return spec


def compile_scene(robot: Robot, physics: Physics, scene: Scene, timing: Timing) -> Any:
    """The model that is stepped. Its first sensor makes MuJoCo compute `cfrc_ext`, which holds all contact forces."""
    spec = scene_spec(robot, physics, scene, timing, dressed=False)
    for body in robot.sole_bodies:  # the force between each foot and the ground, world frame, over a control period
        spec.add_sensor(
            name=body,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=body,
            reftype=mujoco.mjtObj.mjOBJ_GEOM,
            refname=GROUND,
            intprm=[FORCE, NET_FORCE, 1],
            nsample=timing.substeps,
        )
    return spec.compile()


def require_stable(model: Any, robot: Robot, timing: Timing) -> None:
    """Raises ValueError where joint damping, computed from the state before a physics step, passes 1 as kd dt / I: a
    speed would then change sign at every step. I: effective inertia of the joint with all others free in the default
    posture, 1 / (M⁻¹)_jj."""
    data = mujoco.MjData(model)
    count = len(robot.joints)
    data.qpos[7 : 7 + count] = robot.default_position
    mujoco.mj_forward(model, data)
    inverse = np.zeros((count, model.nv))
    mujoco.mj_solveM(model, data, inverse, np.eye(count, model.nv, 6))
    rate = robot.kd * inverse[np.arange(count), 6 + np.arange(count)]
    worst = int(np.argmax(rate))
    if rate[worst] * timing.timestep > 1.0:
        stable = timing.period / np.ceil(timing.period * rate[worst] - 1e-9)  # divides the control period
        raise ValueError(
            f"simulation.physics.pd: explicit at a step of {timing.timestep:g} s makes {robot.joints[worst]} buzz: "
            f"kd dt / I is {rate[worst] * timing.timestep:.2f}, it must not pass 1; choose "
            f"simulation.physics.timestep: {stable:g} or shorter"
        )


def _add_motors(spec: Any, robot: Robot, timing: Timing) -> None:
    """torque = kp (target - position) - kd velocity, within the effort limit; motor i drives joint i. Each keeps its
    past targets, so that it can follow a delayed one."""
    for index, joint in enumerate(robot.joints):
        kp, kd, effort = float(robot.kp[index]), float(robot.kd[index]), float(robot.effort[index])
        spec.add_actuator(
            name=joint,
            target=joint,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            gainprm=[kp] + [0.0] * 9,
            biasprm=[0.0, -kp, -kd] + [0.0] * 7,
            forcelimited=True,
            forcerange=[-effort, effort],
            nsample=timing.kept_targets,
        )


def _touches(geom: Any, shape: bool, body_contact: str) -> tuple[int, int]:
    """Contact bits of a link's geom: its own and those it touches; `shape`: whether it is a collision shape. Hands and
    forearms hold the object with palms or grips, and do not touch it themselves."""
    links = (geom.contype, geom.conaffinity & ~OBJECT_BIT) if body_contact == "everything" else (0, 0)
    solid = shape and body_contact != "nothing" and not any(part in geom.parent.name for part in HOLDING)
    return links[0], links[1] | (OBJECT_BIT if solid else 0)


class ModelIndex:
    """Indices into the arrays of a model and of its data. The robot comes first, then the object."""

    def __init__(self, model: Any, robot: Robot) -> None:
        """Finds everything by name; checks that the joints are in the robot's order."""
        names = [model.joint(index).name for index in range(model.njnt)]
        count = len(robot.joints)
        if tuple(names[1 : count + 1]) != robot.joints:
            raise ValueError(f"{robot.mjcf}: joints compile to {names}, expected a free joint and then {robot.joints}")
        bodies = {model.body(index).name: index for index in range(model.nbody)}
        sites = {model.site(index).name: index for index in range(model.nsite)}
        geoms = {model.geom(index).name: index for index in range(model.ngeom)}
        self.joints = slice(7, 7 + count)
        """Robot's joint positions in qpos."""
        self.joint_speeds = slice(6, 6 + count)
        """Robot's joint velocities in qvel."""
        self.object: int | None = bodies.get("object")
        """Body of the object."""
        self.object_position = None if self.object is None else slice(7 + count, model.nq)
        """Object in qpos: a pose, or x, y and yaw of a crate."""
        self.base, self.torso = bodies[robot.base], bodies[robot.torso]
        self.feet = _places(bodies, robot.sole_bodies)
        """Bodies of the feet, (2,)."""
        self.hands = _places(bodies, robot.wrist_bodies if self.object is None else HANDS)
        """Bodies of the hands, (2,); without an object those of the wrists."""
        self.wrists = _places(bodies, robot.wrist_bodies)
        """Bodies of the wrists, (2,)."""
        self.links = _places(bodies, robot.tree.bodies)
        """Bodies of the robot's own description, in its order."""
        self.soles, self.grips = _places(sites, robot.soles), _places(sites, robot.wrists)
        """Sites of the soles and of the grips, (2,)."""
        self.object_grips = _pair(sites, "object_left_grip", "object_right_grip")
        """Sites on the object to which the grips are connected, (2,)."""
        feet = [bodies[name] for name in robot.sole_bodies]
        self.foot_geoms = np.flatnonzero(np.isin(model.geom_bodyid, feet) & (model.geom_conaffinity != 0))
        """Contact points of the feet."""
        self.palms = _pair(geoms, "left_palm", "right_palm")
        """Geoms of the palms, (2,)."""
        self.object_geom: int | None = geoms.get("object")
        """Geom with which the object touches palms."""


def _places(indices: dict[str, int], names: Iterable[str]) -> slice | Indices:
    return as_slice(np.array([indices[name] for name in names]))


def _pair(indices: dict[str, int], left: str, right: str) -> Indices | None:
    return np.array([indices[left], indices[right]]) if left in indices else None
