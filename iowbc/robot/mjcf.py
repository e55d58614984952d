"""Reads a robot's MJCF as a tree of bodies with NumPy alone: kinematics where there is no simulator."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.files import read_limited
from iowbc.robot import rotations

LARGEST_FILE = 1_000_000
"""Largest size of a robot's files [bytes]."""


@dataclass(frozen=True)
class Hinge:
    """A hinge joint at its body's origin."""

    name: str
    axis: Array
    """Unit axis in the body frame, shape (3,)."""
    lower: float
    upper: float
    """Range [rad]."""
    effort: float
    """Largest torque [N·m]."""
    armature: float
    """Rotor inertia seen at the joint [kg·m²]."""


@dataclass(frozen=True)
class Capsule:
    """A collision shape in its body's frame; a sphere is a capsule of no length."""

    name: str
    start: Array
    end: Array
    """Ends of the axis, shape (3,) [m]."""
    radius: float


@dataclass(frozen=True)
class Body:
    """A body, its place in the parent's frame, and what is attached to it."""

    name: str
    parent: str | None
    position: Array
    """Origin in the parent's frame, shape (3,) [m]."""
    quaternion: Array
    """Orientation in the parent's frame, wxyz."""
    hinge: Hinge | None
    sites: dict[str, Array]
    """Position of each site in the body frame, shape (3,) [m]."""
    capsules: tuple[Capsule, ...]
    """Shapes of class `body`: those that can collide with other links."""
    feet: Array
    """Ground contact points of class `foot`: x and y in the body frame, shape (points, 2) [m]."""
    mass: float = 0.0
    """[kg]."""
    centre: Array = field(default_factory=lambda: np.zeros(3))
    """Centre of mass in the body frame, shape (3,) [m]."""


@dataclass(frozen=True)
class Tree:
    """The bodies in the file's order (parents first)."""

    bodies: dict[str, Body]
    excluded: frozenset[frozenset[str]] = field(default_factory=frozenset)
    """Pairs of bodies that are never checked for collision."""

    def hinges(self) -> tuple[Hinge, ...]:
        """Joints in MuJoCo's order."""
        return tuple(body.hinge for body in self.bodies.values() if body.hinge is not None)

    def body_of_site(self, site: str) -> Body:
        """The body that carries a site."""
        for body in self.bodies.values():
            if site in body.sites:
                return body
        known = sorted(name for body in self.bodies.values() for name in body.sites)
        raise ValueError(f"the MJCF has no site {site!r}; its sites are {', '.join(known)}")

    def chain(self, end: str, start: str) -> tuple[Body, ...]:
        """Bodies from below `start` down to `end`."""
        found: list[Body] = []
        name: str | None = end
        while name != start:
            if name is None or name not in self.bodies:
                raise ValueError(f"body {end!r} does not descend from {start!r} in the MJCF")
            found.append(self.bodies[name])
            name = self.bodies[name].parent
        return tuple(reversed(found))

    def hinges_between(self, end: str, start: str) -> tuple[Hinge, ...]:
        """Hinges from below body `start` down to body `end`."""
        return tuple(body.hinge for body in self.chain(end, start) if body.hinge is not None)

    def mover(self, name: str) -> Body:
        """The nearest body with a hinge: the body itself or an ancestor; the root if there is none."""
        body = self.bodies[name]
        while body.hinge is None and body.parent is not None:
            body = self.bodies[body.parent]
        return body

    def carrier(self, site: str) -> tuple[Body, Array]:
        """The body that moves a site, and the site's place in that body's frame, (3,) [m]."""
        mover = self.mover(self.body_of_site(site).name)
        return mover, self.forward({}, mover.name, site)[0]

    def rigid_mass(self, name: str) -> tuple[float, Array]:
        """Mass [kg] of a body with all that is fixed to it, and their first moment in its frame, (3,) [kg·m]."""
        body = self.bodies[name]
        mass, moment = body.mass, body.mass * body.centre
        for child in self.bodies.values():
            if child.parent == name and child.hinge is None:
                more, further = self.rigid_mass(child.name)
                mass += more
                moment = moment + more * child.position + rotations.matrix(child.quaternion) @ further
        return mass, moment

    def forward(self, joint_position: dict[str, float], start: str, site: str) -> tuple[Array, Array]:
        """Position (3,) and rotation (3, 3) of a site in the frame of body `start`."""
        end = self.body_of_site(site)
        position, rotation = self.pose(joint_position, start, end.name)
        return position + rotation @ end.sites[site], rotation

    def pose(self, joint_position: dict[str, float], start: str, end: str) -> tuple[Array, Array]:
        """Position (3,) and rotation (3, 3) of body `end` in the frame of body `start`."""
        position, rotation = np.zeros(3), np.eye(3)
        for body in self.chain(end, start):
            position = position + rotation @ body.position
            rotation = rotation @ rotations.matrix(body.quaternion)
            if body.hinge is not None:
                angle = np.asarray(joint_position[body.hinge.name])
                rotation = rotation @ rotations.axis_matrix(body.hinge.axis, angle)
        return position, rotation


def small_text(path: Path) -> str:
    """Text of one of a robot's files. Raises OSError, or ValueError for a file of another kind or too large."""
    return read_limited(path, LARGEST_FILE).decode("utf-8")


UNREAD = {
    "compiler": dict.fromkeys(("settotalmass", "eulerseq"), "give masses, and orientations as quat, on the elements"),
    "body": dict.fromkeys(("euler", "axisangle", "xyaxes", "zaxis"), "give the orientation as quat"),
    "joint": {"pos": "place the body's origin on its joint's axis"},
}
"""Attributes by element that would change the model and are not read, and what to write instead."""


def read_tree(path: Path) -> Tree:
    """Reads a self-contained MJCF, with its numbers on the elements themselves (classes decide contact and look).
    Raises OSError, or ValueError with what is wrong."""
    try:
        root = ElementTree.fromstring(small_text(path))
    except ElementTree.ParseError as error:
        raise ValueError(f"{path}: not well-formed XML: {error}") from error
    for element in root.iter():
        if element.tag == "include" or "file" in element.attrib:
            raise ValueError(
                f"{path}: <{element.tag} file={element.get('file')!r}> reads another file, and no export takes it: "
                "describe all in this one, with primitive shapes"
            )
        for attribute, instead in UNREAD.get(element.tag, {}).items():
            if attribute in element.attrib:
                named, value = element.get("name", "the model"), element.attrib[attribute]
                text = f"<{element.tag} {attribute}={value!r}> of {named!r} is not read"
                raise ValueError(f"{path}: {text}: {instead}")
    compiler = root.find("compiler")
    if compiler is None or compiler.get("angle") != "radian":
        raise ValueError(f'{path}: angles are read in radians: give <compiler angle="radian"/>')
    world = root.find("worldbody")
    if world is None:
        raise ValueError(f"{path}: no <worldbody>")
    if world.find("body/freejoint") is None or root.find("actuator") is not None:
        raise ValueError(f"{path}: expected a <freejoint> in the base, and no <actuator>: the program adds motors")
    bodies = {body.name: body for child in world.findall("body") for body in _bodies(child, None, path)}
    excluded = frozenset(
        frozenset((pair.attrib["body1"], pair.attrib["body2"])) for pair in root.findall("contact/exclude")
    )
    return Tree(bodies, excluded)


def _bodies(element: ElementTree.Element, parent: str | None, path: Path) -> Iterator[Body]:
    name = element.attrib.get("name")
    if name is None:
        raise ValueError(f"{path}: a body inside {parent or 'the world'!r} has no name")
    joints, inertial, geoms = element.findall("joint"), element.find("inertial"), element.findall("geom")
    if len(joints) > 1 or any(joint.get("type", "hinge") != "hinge" for joint in joints):
        raise ValueError(f"{path}: body {name!r}: expected one hinge at most")
    feet = [_numbers(geom, "pos", "0 0 0")[:2] for geom in geoms if geom.get("class") == "foot"]
    yield Body(
        name=name,
        parent=parent,
        position=_numbers(element, "pos", "0 0 0"),
        quaternion=rotations.normalized(_numbers(element, "quat", "1 0 0 0")),
        hinge=_hinge(joints[0], path) if joints else None,
        sites={site.attrib["name"]: _numbers(site, "pos", "0 0 0") for site in element.findall("site")},
        capsules=tuple(_capsule(geom) for geom in geoms if geom.get("class") == "body"),
        feet=np.array(feet).reshape(-1, 2),
        mass=0.0 if inertial is None else float(inertial.attrib["mass"]),
        centre=np.zeros(3) if inertial is None else _numbers(inertial, "pos", "0 0 0"),
    )
    for child in element.findall("body"):
        yield from _bodies(child, name, path)


def _hinge(element: ElementTree.Element, path: Path) -> Hinge:
    for needed in ("name", "axis", "range", "actuatorfrcrange", "armature"):
        if needed not in element.attrib:
            raise ValueError(f"{path}: joint {element.attrib.get('name', '?')!r} lacks the attribute {needed!r}")
    axis, limits = _numbers(element, "axis", ""), _numbers(element, "range", "")
    if not np.linalg.norm(axis) > 0.0:
        raise ValueError(f"{path}: joint {element.attrib['name']!r} has the axis {element.attrib['axis']!r}")
    return Hinge(
        name=element.attrib["name"],
        axis=axis / np.linalg.norm(axis),
        lower=float(limits[0]),
        upper=float(limits[1]),
        effort=float(_numbers(element, "actuatorfrcrange", "")[1]),
        armature=float(element.attrib["armature"]),
    )


def _capsule(element: ElementTree.Element) -> Capsule:
    radius = float(element.attrib["size"].split()[0])
    name = element.attrib.get("name", "")
    if "fromto" in element.attrib:
        ends = _numbers(element, "fromto", "")
        return Capsule(name, ends[:3], ends[3:], radius)
    centre = _numbers(element, "pos", "0 0 0")
    return Capsule(name, centre, centre, radius)


def _numbers(element: ElementTree.Element, attribute: str, default: str) -> Array:
    return np.array([float(word) for word in element.attrib.get(attribute, default).split()])
