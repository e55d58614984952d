"""The simulation of a scene for the browser: MJCF, the numbers that MJCF rounds, start, and shapes for the eye."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import nominal_command
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.scene import Scene
from iowbc.robot.description import Robot
from iowbc.sim.model import scene_spec
from iowbc.sim.objects import HANDS, measured
from iowbc.sim.simulation import Simulation
from iowbc.sim.timing import Timing
from iowbc.sim.world import World
from iowbc.task.specification import Specification

KINDS = ("free", "lift")
"""Kinds of scenes that the page simulates; it lacks the direction-dependent friction of a crate's wheels."""
FIELDS = (
    *("qpos0", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos", "jnt_axis"),
    *("jnt_range", "jnt_actfrcrange", "dof_armature", "dof_damping", "dof_frictionloss", "geom_pos", "geom_quat"),
    *("geom_size", "geom_friction", "geom_rbound", "geom_aabb", "site_pos", "site_quat"),
    *("actuator_gainprm", "actuator_biasprm"),
)
"""Arrays of the model that are written in full precision."""
STILL = ("start_yaw", "partner_share", "impulse_scale", "push_scale", "noise_scale")
"""Quantities of an episode that are zero on the page: initial heading, partner, disturbances, sensor noise."""
ABOVE = 1e-6
"""Initial height above the ground [m]: contacts of soles exactly on it would depend on the browser's rounding."""
HEAVIEST = 1.5
"""Mass to which the page's slider goes, as a part of the object's nominal one (Table I: to 150 %)."""


def web_scenes(world: Specification, robot: Robot) -> dict[str, Any]:
    """Every scene that a page can show, by name, at the nominal values of all that training draws."""
    scenes = world.recipe.simulation.scenes
    return {name: _web_scene(world, robot, scene, name) for name, scene in scenes if _playable(scene)}


def accepted(recipe: Recipe) -> list[tuple[str, float]]:
    """Scenes and object masses [kg] of the acceptance trials that the page can show."""
    scenes, trials = recipe.simulation.scenes, recipe.export.acceptance
    return [(one.scene, one.mass) for one in trials if one.mass > 0.0 and _playable(getattr(scenes, one.scene))]


def _playable(scene: Scene) -> bool:
    """True where the page can simulate and draw a scene; it draws no meshes."""
    return scene.kind in KINDS and (scene.object is None or scene.object.mesh is None)


def _web_scene(world: Specification, robot: Robot, scene: Scene, name: str) -> dict[str, Any]:
    recipe, simulation = world.recipe, begun(world, robot, name)
    started, drawn = simulation.worlds[0], simulation.drawn
    layout, physics = started.layout, recipe.simulation.physics
    timing = Timing(simulation.period, physics.timestep, 0)
    own = {each: field[0] for each, field in started.fields.arrays.items()}  # after the start
    described = {
        "kind": scene.kind,
        "xml": _plain(scene_spec(robot, physics, scene, timing, dressed=False)),
        "fields": {each: np.ravel(own.get(each, getattr(started.model, each))).tolist() for each in FIELDS},
        "start": started.qpos[0].tolist(),
        "period": simulation.period,
        "substeps": timing.substeps,
        "base": layout.base,
        "torso": layout.torso,
        "joints": {
            "position": [layout.joints.start, layout.joints.stop],
            "velocity": [layout.joint_speeds.start, layout.joint_speeds.stop],
        },
        "drives": {
            "effort": simulation.motor_effort[0].tolist(),
            "speed": robot.velocity_limit.tolist(),
            "corner": physics.torque_corner,
            "kp": robot.kp.tolist(),
            "kd": robot.kd.tolist(),
            "linkages": robot.linkages.tolist(),
        },
        "looks": looks(scene_spec(robot, physics, scene, timing, dressed=True).compile(), started.model),
    }
    if scene.object is None or layout.object is None:
        return described | {"object": None, "hold": None}
    count = started.model.nbody
    hands, wrists = (np.arange(count)[places].tolist() for places in (layout.hands, layout.wrists))
    shape = measured(scene.object)
    thing = {
        "body": layout.object,
        "shape": scene.object.shape,
        "mass": scene.object.mass,
        "first": next((mass for place, mass in accepted(recipe) if place == name), scene.object.mass),
        "least": scene.object.smallest_mass,
        "least_inertia": scene.object.smallest_inertia,
        "most": HEAVIEST * scene.object.mass,
        "inertia_per_mass": shape.principal.tolist(),
    }
    hold = _hold(started, robot, scene, shape.about_axes, drawn)
    return described | {"object": thing, "hold": hold, "hands": hands, "wrists": wrists}


def begun(world: Specification, robot: Robot, name: str, mass: float = np.nan) -> Simulation:
    """One undisturbed simulation of a scene at the start of an episode; `mass` of the object [kg], NaN: nominal."""
    recipe = world.recipe
    quiet = recipe.simulation.randomization.model_copy(update={"enabled": False})
    alone = recipe.simulation.partner.model_copy(update={"enabled": False})
    simulation = Simulation(
        robot,
        recipe.simulation.model_copy(update={"randomization": quiet, "partner": alone}),
        envs=np.zeros(1),
        seed=0,
        scenes=[name],
        fixed={**{each: np.zeros(1) for each in STILL}, "object_mass": np.array([mass])},
        control_frequency=recipe.task.control_frequency,
    )
    references = ReferenceLayer(robot, recipe.task.references, world.rg)
    command = references.clamp(references.start_command(nominal_command(recipe.task.commands)[None]))
    arms, posture = references.start(command, both_wrists(getattr(recipe.task.references.grasps, name))[None])
    joints = np.empty((1, len(robot.joints)))
    joints[:, robot.support], joints[:, robot.interaction] = posture, arms
    simulation.reset(np.zeros(1, np.int64), joints, references.start_pitch(posture, command))
    simulation.worlds[0].qpos[:, 2] += ABOVE
    simulation.worlds[0].batch.forward()
    return simulation


def _plain(spec: Any) -> str:
    """The MJCF, without the memory of motors and sensors, which the page has no delays for."""
    for part in (*spec.actuators, *spec.sensors):
        part.nsample = 0
    return spec.to_xml()


def _hold(world: World, robot: Robot, scene: Scene, inertia: Array, drawn: Mapping[str, Array]) -> dict[str, Any]:
    """Parameters of the grasp in addition to its connection or contact with the object."""
    grasp, layout, model = scene.grasp, world.layout, world.model
    compliant = grasp.kind == "compliant"
    places = np.arange(model.nsite)[layout.grips] if layout.palms is None else layout.palms
    sides = np.split(robot.interaction, 2)
    return {
        "compliant": compliant,
        "points": places.tolist(),
        "arms": [
            [{"joint": int(joint), "hinge": int(joint) + 1, "kp": float(robot.kp[joint])} for joint in side]
            for side in sides
        ],
        "sensors": [int(model.sensor(name).adr[0]) for name in HANDS],
        "handover": grasp.handover / world.timing.period,
        "squeeze": 0.0 if compliant else grasp.squeeze,
        "by_friction": grasp.by_friction if compliant else 0.0,
        "friction": float(drawn["surface_friction"][0]),
        "slip_force": float(drawn["slip_force"][0]),
        "about": float(inertia[1] + grasp.height**2),
        **grasp.model_dump(include={"strength", "torsion", "stability", "stiffness", "swing_damping"}),
    }


SHOWN = 2
"""Highest group of geoms that MuJoCo's viewer draws at first."""
SHAPES = {
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
}


def looks(dressed: Any, stepped: Any) -> list[dict[str, Any]]:
    """Shapes of the model `dressed` for the eye, each with its body in the model that is `stepped`: half sizes and
    positions [m] in the body's frame; quaternions wxyz; colours red, green, blue, alpha in 0 to 1."""
    found = []
    for index in range(dressed.ngeom):
        shape = SHAPES.get(mujoco.mjtGeom(dressed.geom_type[index]))
        if shape is None or dressed.geom_group[index] > SHOWN or dressed.geom_rgba[index, 3] == 0.0:
            continue
        body = stepped.body(dressed.body(dressed.geom_bodyid[index]).name).id
        found.append(
            {
                "body": int(body),
                "shape": shape,
                "size": [round(value, 5) for value in dressed.geom_size[index].tolist()],
                "position": [round(value, 5) for value in dressed.geom_pos[index].tolist()],
                "quaternion": [round(value, 6) for value in dressed.geom_quat[index].tolist()],
                "colour": [round(value, 3) for value in dressed.geom_rgba[index].tolist()],
            }
        )
    return found
