"""Reads a robot's MJCF as a tree of bodies with NumPy alone: kinematics where there is no simulator."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.files import read_limited
from iowbc.robot import rotations

LARGEST_ANGLE = 2.0 * np.pi
"""Largest limit of a joint [rad]; larger ones are probably degrees."""
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
    try:
        return read_limited(path, LARGEST_FILE).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is no UTF-8 text: {error}") from error


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
    if world.find("geom") is not None:
        raise ValueError(f"{path}: a <geom> of the world: remove it, the program adds the ground")
    try:
        bodies = {body.name: body for child in world.findall("body") for body in _bodies(child, None)}
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    excluded = frozenset(
        frozenset((pair.attrib["body1"], pair.attrib["body2"])) for pair in root.findall("contact/exclude")
    )
    return Tree(bodies, excluded)


def _bodies(element: ElementTree.Element, parent: str | None) -> Iterator[Body]:
    name = element.attrib.get("name")
    if name is None:
        raise ValueError(f"a body inside {parent or 'the world'!r} has no name")
    joints, inertial, geoms = element.findall("joint"), element.find("inertial"), element.findall("geom")
    if len(joints) > 1 or any(joint.get("type", "hinge") != "hinge" for joint in joints):
        raise ValueError(f"body {name!r}: expected one hinge at most")
    mass = 0.0 if inertial is None else float(_numbers(inertial, "mass", 1)[0])
    if mass < 0.0:
        raise ValueError(f"body {name!r}: has the mass {mass:g} kg")
    feet = [_numbers(geom, "pos", 3, "0 0 0")[:2] for geom in geoms if geom.get("class") == "foot"]
    yield Body(
        name=name,
        parent=parent,
        position=_numbers(element, "pos", 3, "0 0 0"),
        quaternion=rotations.normalized(_numbers(element, "quat", 4, "1 0 0 0")),
        hinge=_hinge(joints[0]) if joints else None,
        sites={site.attrib["name"]: _numbers(site, "pos", 3, "0 0 0") for site in element.findall("site")},
        capsules=tuple(_capsule(geom) for geom in geoms if geom.get("class") == "body"),
        feet=np.array(feet).reshape(-1, 2),
        mass=mass,
        centre=np.zeros(3) if inertial is None else _numbers(inertial, "pos", 3, "0 0 0"),
    )
    for child in element.findall("body"):
        yield from _bodies(child, name)


def _hinge(element: ElementTree.Element) -> Hinge:
    name = element.attrib.get("name", "?")
    for needed in ("name", "axis", "range", "actuatorfrcrange", "armature"):
        if needed not in element.attrib:
            raise ValueError(f"joint {name!r} lacks the attribute {needed!r}")
    axis, (lower, upper) = _numbers(element, "axis", 3), _numbers(element, "range", 2).tolist()
    effort, armature = float(_numbers(element, "actuatorfrcrange", 2)[1]), float(_numbers(element, "armature", 1)[0])
    for wrong, attribute, expected in (
        (not np.linalg.norm(axis) > 0.0, "axis", "a direction"),
        (not -LARGEST_ANGLE <= lower < upper <= LARGEST_ANGLE, "range", "two angles in radians, the smaller one first"),
        (effort <= 0.0, "actuatorfrcrange", "a largest torque above 0"),
        (armature < 0.0, "armature", "an inertia of 0 or more"),
    ):
        if wrong:
            raise ValueError(f"joint {name!r} has the {attribute} {element.attrib[attribute]!r}, expected {expected}")
    return Hinge(name, axis / np.linalg.norm(axis), lower, upper, effort, armature)


def _capsule(element: ElementTree.Element) -> Capsule:
    radius = _numbers(element, "size", len(element.get("size", "").split()) or 1)[0].item()
    name = element.attrib.get("name", "")
    if "fromto" in element.attrib:
        ends = _numbers(element, "fromto", 6)
        return Capsule(name, ends[:3], ends[3:], radius)
    centre = _numbers(element, "pos", 3, "0 0 0")
    return Capsule(name, centre, centre, radius)


def _numbers(element: ElementTree.Element, attribute: str, count: int, default: str = "") -> Array:
    text = element.attrib.get(attribute, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        where = f"<{element.tag} {attribute}={text!r}> of {element.get('name', 'an element without a name')!r}"
        raise ValueError(f"{where}: expected {count} finite {'number' if count == 1 else 'numbers'}")
    return values
