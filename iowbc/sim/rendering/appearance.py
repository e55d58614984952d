"""The visual model of a scene: ground, light, object, the robot's meshes where they are installed."""

import sysconfig
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from iowbc.robot.description import Robot
from iowbc.sim.model import scene_spec
from iowbc.sim.simulation import Simulation

LIGHT_PARTS = (0.80, 0.81, 0.83, 1.0)
DARK_PARTS = (0.16, 0.17, 0.19, 1.0)
DARK_LINKS = ("ankle", "hip_pitch", "hip_roll", "waist", "shoulder_pitch", "wrist", "hand", "head", "logo", "contour")
"""Links of the robot that are dark, by part of their name."""
LARGEST_FRAME = (1920, 1088)


@dataclass(frozen=True)
class Mesh:
    """A file to draw on a body."""

    link: str
    body: str
    file: Path
    position: tuple[float, ...]
    """Origin of the mesh in the body's frame [m]."""


class Appearance:
    """The visual model of one environment of a simulation, and data that follow its state."""

    def __init__(self, simulation: Simulation, env: int) -> None:
        self._world, self._index = simulation.world_of(env)
        robot, world = simulation.robot, self._world
        spec = scene_spec(robot, world.physics, world.scene, world.timing, dressed=True)
        _add_visuals(spec)
        meshes = list(installed_meshes(robot))
        if meshes:
            _replace_by_meshes(spec, robot, meshes)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.update()

    def update(self) -> Any:
        """The data in the environment's present state: positions of bodies, cameras and lights."""
        world, index, data = self._world, self._index, self.data
        data.qpos[:], data.qvel[:] = world.qpos[index], world.qvel[index]
        if world.layout.object_geom is not None:
            self.model.geom("object").size[:] = world.fields.arrays["geom_size"][index, world.layout.object_geom]
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_camlight(self.model, data)
        return data


def installed_meshes(robot: Robot) -> Iterator[Mesh]:
    """Meshes that `example-robot-data` has for the robot; none if it is not installed or lacks the robot."""
    shared = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
    folder = shared / f"{robot.name}_description"
    trees = [ElementTree.parse(file).getroot() for file in sorted(folder.glob("urdf/*.urdf"))]
    fitting = [tree for tree in trees if {*robot.joints} <= {joint.get("name") for joint in tree.iter("joint")}]
    if not fitting:
        return
    tree = min(fitting, key=lambda candidate: len(candidate.findall("link")))
    fixed = {_named(joint, "child"): joint for joint in tree.iter("joint") if joint.get("type") == "fixed"}
    for link in tree.findall("link"):
        shape = link.find("visual/geometry/mesh")
        if shape is None:
            continue
        body, position = str(link.get("name")), np.zeros(3)
        while body not in robot.tree.bodies and body in fixed:
            position = position + _origin(fixed[body])
            body = _named(fixed[body], "parent")
        if body in robot.tree.bodies:
            file = folder / "meshes" / Path(str(shape.get("filename"))).name
            yield Mesh(str(link.get("name")), body, file, tuple(position.tolist()))


def _named(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else str(found.get("link"))


def _origin(joint: ElementTree.Element) -> Any:
    found = joint.find("origin")
    text = "0 0 0" if found is None else found.get("xyz", "0 0 0")
    return np.array([float(number) for number in text.split()])


def _replace_by_meshes(spec: Any, robot: Robot, meshes: list[Mesh]) -> None:
    """Draws the meshes, and hides the robot's primitive shapes in a group that is not drawn."""
    for geom in spec.geoms:
        if geom.parent.name in robot.tree.bodies:
            geom.group = 4
    for mesh in meshes:
        spec.add_mesh(name=mesh.link, file=str(mesh.file))
        dark = any(part in mesh.link for part in DARK_LINKS)
        spec.body(mesh.body).add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=mesh.link,
            pos=mesh.position,
            contype=0,
            conaffinity=0,
            group=2,
            rgba=DARK_PARTS if dark else LIGHT_PARTS,
        )


def _add_visuals(spec: Any) -> None:
    """Sky, checkered ground, one light with shadows."""
    spec.visual.global_.offwidth, spec.visual.global_.offheight = LARGEST_FRAME
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.45, 0.45, 0.45), (0.35, 0.35, 0.35)
    spec.visual.headlight.specular = (0.1, 0.1, 0.1)
    spec.visual.quality.shadowsize = 2048
    spec.stat.extent, spec.stat.center = 2.0, (0.0, 0.0, 0.7)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.93, 0.95, 0.97),
        rgb2=(0.68, 0.75, 0.83),
        width=64,
        height=64,
    )
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=(0.82, 0.84, 0.86),
        rgb2=(0.76, 0.78, 0.81),
        markrgb=(0.70, 0.72, 0.75),
        width=256,
        height=256,
    )
    material = spec.add_material(name="tiles", texrepeat=(1.0, 1.0), texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    spec.geom("ground").material, spec.geom("ground").castshadow = "tiles", False
    spec.body(spec.worldbody.first_body().name).add_light(
        pos=(1.0, 2.0, 4.0),
        dir=(-0.22, -0.44, -0.87),
        mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACK,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=(0.55, 0.55, 0.55),
        specular=(0.2, 0.2, 0.2),
        castshadow=True,
    )
