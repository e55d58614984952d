"""Scenes of the simulation: no object, an object held between the wrists, a crate to push, and custom scenes."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.beside import MeshFile
from iowbc.recipe.section import LATER, NamedEntries, Problems, Section, Vector


class Grasp(Section):
    """Hold of the hands on the object in a lift scene."""

    kind: Literal["compliant", "contact"] = "compliant"
    """`compliant`: an elastic connection that releases above its slip force; `contact`: friction between two palms."""
    time_constant: float = Field(default=0.02, gt=0.0)
    """Time constant of the compliant connection [s]; at least two physics steps, as for every soft constraint."""
    strength: float = Field(default=140.0, ge=0.0)
    """Equivalent normal force of each hand in a compliant grasp [N]; multiplied by the surface friction, it is the slip
    force of the hand. At friction 1.0 two hands hold 28 kg; the tyre at 150 % weighs 27."""
    squeeze: float = Field(default=60.0, ge=0.0)
    """Force with which the arms press each palm against an object held by contact [N], from motor torques added to the
    joint control. At friction 1.0 it holds 9.5 kg and takes 15 of the 25 N·m at the shoulders."""
    by_friction: float = Field(default=1.0, ge=0.0, le=1.0)
    """Fraction of a hand's load in a compliant grasp that friction bears. For it the palm presses with load / friction,
    which loads the arms' motors; fingers beneath the object bear the rest."""
    stiffness: float = Field(default=4.0, ge=0.0)
    """Stiffness with which the palms resist rotation of the object about the line between them [N·m/rad]. It is low
    enough that a box still hangs and that 5 N·m wrists bear the torque of tilted hands, and high enough to bear the
    imbalance that a partner leaves."""
    torsion: float = Field(default=0.02, ge=0.0, json_schema_extra=LATER)
    """Ratio of a palm's slip torque about the line between the hands to its slip force [m]: two thirds of the radius of
    a 3 cm contact patch. Two hands of a compliant grasp bear 5.6 N·m at friction 1.0."""
    stability: float = Field(default=0.3, gt=0.0, le=1.0)
    """Bound on that stiffness · period² / inertia, and on damping · period / inertia. Above it, a torque held over a
    control period would make a light object oscillate."""
    near_end: float = Field(default=0.8, ge=0.0, le=1.0)
    """Farthest position of the grips of an object carried by two, as a fraction of the way from its middle to its near
    end. The position makes the lever arms match the carriers' shares of the weight."""
    height: float = 0.08
    """Height of the grips above the object's centre [m]; above the centre of mass, so that the object hangs stably."""
    settling: int = Field(default=5, ge=0, le=1000)
    """Iterations of MuJoCo's noslip solver in each physics step, with the elliptic friction cone; they remove the creep
    of a grasp by contact."""
    handover: float = Field(default=0.5, ge=0.0)
    """Ramp of the object's weight at the start of an episode [s]; a sudden load would pull with twice the weight."""
    swing_damping: float = Field(default=3.0, ge=0.0)
    """Damping rate of the object's rotation relative to the hands [1/s]; a box on two points swings at 1.0 Hz."""


class Object(Section):
    """A rigid object, uniform at its nominal mass."""

    shape: Literal["box", "tyre", "cylinder", "mesh"]
    """`box`; `tyre`: a ring that stands across the robot's path, so that the hands hold its rim on both sides;
    `cylinder`: upright; `mesh`: triangles of a file, whose convex hull determines contact and inertia."""
    size: Vector | None = None
    """Extent along x (forward), y (left) and z (up) [m]; empty for a mesh, whose size is that of its file."""
    mass: float = Field(gt=0.0)
    """Nominal mass [kg]."""
    smallest_mass: float = Field(default=0.05, gt=0.0)
    """Smallest simulated mass [kg]; smaller ones, including zero, are raised to it: a free body needs inertia."""
    smallest_inertia: float = Field(default=0.5, gt=0.0, json_schema_extra=LATER)
    """Mass whose inertia lighter objects have [kg]; their weight stays their own. Forces of grip and partner are held
    over a control period; on a body with less inertia they would have to be so soft (`stability`) that a 0.05 kg box
    turned over between its carriers."""
    mesh: MeshFile | None = Field(default=None, json_schema_extra=LATER)
    """An .obj or .stl file beside the recipe, x forward and z up."""
    scale: float = Field(default=1.0, gt=0.0, json_schema_extra=LATER)
    """Metres per unit of the mesh: 0.001 for a file in millimetres."""

    def problems(self) -> Problems:
        if (self.shape == "mesh") != (self.mesh is not None):
            yield "", f"shape {self.shape!r}: {'give its file, `mesh`' if self.mesh is None else 'has no mesh'}"
        elif (self.shape == "mesh") != (self.size is None):
            text = "has the size of its file: leave size out, change `scale`" if self.size else "give its size"
            yield "", f"shape {self.shape!r}: {text}"
        if self.size is not None and min(self.size) <= 0.0:
            yield "", f"size: {list(self.size)} should be positive"
        if self.shape == "cylinder" and self.size is not None and self.size[0] != self.size[1]:
            yield "", f"size: a cylinder is as long as it is wide, got {self.size[0]:g} and {self.size[1]:g} m"
        if self.shape == "tyre" and self.size is not None and self.size[1] != self.size[2]:
            yield "", f"size: a tyre is as wide as it is high, got {self.size[1]:g} and {self.size[2]:g} m"


class Scene(Section):
    """Scene of an episode: the object and how it is handled."""

    kind: Literal["free", "lift", "push"]
    """`free`: no object; `lift`: one held between the wrists; `push`: a crate on omnidirectional wheels."""
    object: Object | None = None
    """The object; empty in a free scene."""
    grasp: Grasp = Grasp()
    palm: Vector = (0.0, -0.03, 0.0)
    """Contact point of the left palm relative to the grip, in the hand's frame [m]; the right palm mirrors it."""
    gap: float = Field(default=0.01, ge=0.0)
    """Distance from the palms to the crate's face at the start of a push [m]."""
    palm_radius: float = Field(default=0.03, gt=0.0)
    """Radius of the spheres with which palms touch an object [m]."""
    yaw_arm: float = Field(default=0.3, gt=0.0)
    """Mean distance of the crate's wheels from its centre [m]. Multiplied by the rolling resistance, it is the torque
    that resists turning."""
    creep: float = Field(default=0.02, gt=0.0)
    """Speed below which a crate counts as at rest [m/s]; the solver lets a stuck crate creep at 1 mm/s."""

    def problems(self) -> Problems:
        if (self.kind == "free") != (self.object is None):
            yield "", f"a {self.kind} scene {'has no' if self.kind == 'free' else 'needs an'} object"
        by_contact = self.kind == "lift" and self.grasp.kind == "contact"
        if by_contact and self.object is not None and self.object.shape != "box":
            yield "", f"a grasp by contact holds a box, whose width fits the hands, not a {self.object.shape}"


class Scenes(NamedEntries):
    """Scenes by name. A recipe may add custom scenes, with `task.references.grasps` and `.loads` of the same name."""

    __pydantic_extra__: dict[str, Scene] = Field(init=False)
    free: Scene = Scene(kind="free")
    """No object."""
    lift: Scene = Scene(kind="lift", object=Object(shape="box", size=(0.30, 0.25, 0.30), mass=7.0))
    """A cardboard box, 7 kg (paper IV-A)."""
    squeeze: Scene = Scene(
        kind="lift", object=Object(shape="box", size=(0.30, 0.25, 0.30), mass=7.0), grasp=Grasp(kind="contact")
    )
    """The same box, held between the palms by friction alone; its width is fitted to the distance of the hands."""
    tyre: Scene = Scene(
        kind="lift", object=Object(shape="tyre", size=(0.18, 0.56, 0.56), mass=18.0), grasp=Grasp(by_friction=0.0)
    )
    """A rubber tyre, 18 kg (paper IV-A); fingers reach beneath its rim."""
    push: Scene = Scene(
        kind="push", object=Object(shape="box", size=(0.70, 0.60, 1.10), mass=65.0), palm=(0.11, 0.0, 0.0)
    )
    """A crate on omnidirectional wheels, 65 kg (paper IV-A)."""
