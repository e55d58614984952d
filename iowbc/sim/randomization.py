"""Draws what is random in an episode, and writes it into the models of a batch."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.distribution import Distribution
from iowbc.recipe.scene import Scene
from iowbc.recipe.simulation import Simulation as Recipe
from iowbc.robot.description import Robot
from iowbc.sim import random
from iowbc.sim.layout import Layout
from iowbc.sim.objects import TORSION, inertia_per_mass

Array = NDArray[Any]
Indices = NDArray[np.int64]

GRAVITY = 9.81

SWITCHES = ("impulse_scale", "push_scale", "noise_scale", "load_scale")
"""Factors on impulses, pushes and sensor noise, and on how far the object's mass may rise above the lower end of its
range. One unless held at another value; zero switches off."""


class Draws:
    """The quantities drawn for n environments, by name; arrays (n,) or (n, k)."""

    def __init__(self, recipe: Recipe, scenes: list[Scene], robot: Robot, links: int) -> None:
        self.recipe = recipe
        n = len(scenes)
        self._entries = _entries(recipe, len(robot.joints), links)
        self._pushing = np.array([scene.kind == "push" for scene in scenes])
        self._with_object = np.array([scene.object is not None for scene in scenes])
        self._nominal_mass = np.array([scene.object.mass if scene.object else 0.0 for scene in scenes])
        self._smallest_mass = np.array([scene.object.smallest_mass if scene.object else 0.0 for scene in scenes])
        self._strength = np.array([scene.grasp.strength for scene in scenes])
        self.values: dict[str, Array] = {name: np.ones(n) for name in SWITCHES}
        for name, (distribution, width) in self._entries.items():
            self.values[name] = np.full((n, width) if width > 1 else n, distribution.nominal)
        self.values["object_mass"] = self._nominal_mass.copy()
        self.values["slip_force"] = self._strength.copy()

    @property
    def names(self) -> tuple[str, ...]:
        """All quantities."""
        return tuple(self.values)

    def draw(self, which: Indices, key: NDArray[np.uint64], fixed: Mapping[str, Array]) -> None:
        """Draws anew for some environments, from the keys of their episodes; `fixed` (n,) holds values, NaN draws."""
        for name in SWITCHES:
            self.values[name][which] = 1.0
        for name, (distribution, width) in self._entries.items():
            drawn = random.draw(key, name, distribution, width)
            self.values[name][which] = drawn if width > 1 else drawn[:, 0]
        if not self.recipe.sensing.enabled:
            self.values["noise_scale"][which] = 0.0
        self._draw_partner_share(which, key)
        for name, values in fixed.items():
            if name != "object_mass":
                self._hold(name, which, values)
        lowest = self._entries["object_mass_scale"][0].low
        self.values["object_mass"][which] = self._nominal_mass[which] * (
            lowest + (self.values["object_mass_scale"][which] - lowest) * self.values["load_scale"][which]
        )
        if "object_mass" in fixed:
            self._hold("object_mass", which, fixed["object_mass"])
        mass = np.maximum(self.values["object_mass"][which], self._smallest_mass[which])
        self.values["object_mass"][which] = np.where(self._with_object[which], mass, 0.0)
        self.values["slip_force"][which] = self.values["surface_friction"][which] * self._strength[which]

    def _draw_partner_share(self, which: Indices, key: NDArray[np.uint64]) -> None:
        partner = self.recipe.partner
        held = random.draw(key, "partner_share", partner.share)[:, 0]
        pushed = random.draw(key, "partner_share", partner.push_share)[:, 0]
        share = np.where(self._pushing[which], pushed, held)
        self.values["partner_share"][which] = share if partner.enabled else 0.0

    def _hold(self, name: str, which: Indices, values: Array) -> None:
        if name not in self.values:
            raise KeyError(f"no randomised quantity {name!r}; there are: {', '.join(sorted(self.values))}")
        held = which[~np.isnan(values[which])]
        target = self.values[name]
        target[held] = values[held] if target.ndim == 1 else values[held, None]


def _entries(recipe: Recipe, joints: int, links: int) -> dict[str, tuple[Distribution, int]]:
    """Distribution and width of each quantity that is drawn on its own."""
    randomization, partner = recipe.randomization, recipe.partner
    widths = {"object_com_offset": 3, "link_mass_scale": links, "link_inertia_scale": links}
    widths |= dict.fromkeys(("joint_friction", "motor_damping", "kp_scale", "kd_scale", "encoder_bias"), joints)
    entries = {name: (value, widths.get(name, 1)) for name, value in randomization if isinstance(value, Distribution)}
    if not randomization.enabled:
        entries = {name: (value.model_copy(update={"enabled": False}), k) for name, (value, k) in entries.items()}
    entries["partner_share"] = (partner.share, 1)
    for name in ("stiffness", "damping", "delay", "pace", "noise"):
        entries[f"partner_{name}"] = (getattr(partner, name), 1)
    return entries


FIELDS = (
    *("body_mass", "body_inertia", "body_ipos", "dof_damping", "dof_frictionloss", "geom_friction"),
    *("actuator_gainprm", "actuator_biasprm", "site_pos", "geom_size", "geom_rbound", "geom_aabb"),
)
"""Model fields that differ between simulations."""


class ModelFields:
    """The parameters of a batch's models that differ between its simulations; writes what was drawn."""

    def __init__(self, batch: Any, layout: Layout, scene: Scene) -> None:
        self._layout, self._scene = layout, scene
        self._fields = {name: batch.expand(name) for name in FIELDS}
        self._nominal = {name: field[0].copy() for name, field in self._fields.items()}
        self._object_inertia = inertia_per_mass(scene.object) if scene.object is not None else np.zeros(3)
        batch.set_const()
        self._batch = batch

    @property
    def body_mass(self) -> Array:
        """(n, bodies) [kg]."""
        mass: Array = self._fields["body_mass"]
        return mass

    def write(self, ids: Indices, drawn: Mapping[str, Array]) -> None:
        """Sets the models of simulations `ids` from rows of drawn values in the same order."""
        links, speeds = self._layout.links, self._layout.joint_speeds
        fields, nominal = self._fields, self._nominal
        mass = drawn["link_mass_scale"]
        fields["body_mass"][ids, links] = nominal["body_mass"][links] * mass
        inertia = mass * drawn["link_inertia_scale"]
        fields["body_inertia"][ids, links] = nominal["body_inertia"][links] * inertia[..., None]
        fields["dof_damping"][ids, speeds] = drawn["motor_damping"]
        fields["dof_frictionloss"][ids, speeds] = drawn["joint_friction"]
        fields["actuator_gainprm"][ids, :, 0] = nominal["actuator_gainprm"][:, 0] * drawn["kp_scale"]
        fields["actuator_biasprm"][ids, :, 1] = nominal["actuator_biasprm"][:, 1] * drawn["kp_scale"]
        fields["actuator_biasprm"][ids, :, 2] = nominal["actuator_biasprm"][:, 2] * drawn["kd_scale"]
        fields["geom_friction"][ids[:, None], self._layout.foot_geoms, 0] = drawn["ground_friction"][:, None]
        if self._layout.object is not None:
            self._write_object(ids, drawn)
        self._batch.set_const(np.sort(ids))

    def _write_object(self, ids: Indices, drawn: Mapping[str, Array]) -> None:
        fields, thing, speed = self._fields, self._layout.object, self._layout.object_velocity
        mass = drawn["object_mass"]
        inertia = self._object_inertia * (mass * drawn["inertia_scale"])[:, None]
        fields["body_mass"][ids, thing] = mass
        fields["body_inertia"][ids, thing] = inertia
        fields["body_ipos"][ids, thing] = drawn["object_com_offset"]
        if self._scene.kind == "push":
            resistance = drawn["object_ground_friction"] * mass * GRAVITY
            lever = np.array([1.0, 1.0, self._scene.yaw_arm])
            fields["dof_frictionloss"][ids, speed] = resistance[:, None] * lever
        elif speed is not None:
            turning = slice(speed.start + 3, speed.stop)
            fields["dof_damping"][ids, turning] = self._scene.grasp.swing_damping * inertia
        if self._layout.palms is not None:
            friction = drawn["surface_friction"][:, None]
            fields["geom_friction"][ids[:, None], self._layout.palms, 0] = friction
            fields["geom_friction"][ids[:, None], self._layout.palms, 1] = TORSION * friction

    def place_grips(self, ids: Indices, places: Array) -> None:
        """Where on the object the grips are connected, (k, 2, 3), object frame [m]."""
        self._fields["site_pos"][ids[:, None], self._layout.object_grips] = places

    def fit_width(self, ids: Indices, width: Array) -> None:
        """Makes the object as wide as the space between the palms, (k,) [m]."""
        geom = self._layout.object_geom
        half = self._fields["geom_size"][ids, geom]
        half[:, 1] = 0.5 * width
        self._fields["geom_size"][ids, geom] = half
        self._fields["geom_rbound"][ids, geom] = np.sqrt(np.sum(half * half, axis=1))
        self._fields["geom_aabb"][ids, geom, 3:] = half

    def half_size(self, ids: Indices) -> Array:
        """Half extents of the object, (k, 3) [m]."""
        half: Array = self._fields["geom_size"][ids, self._layout.object_geom]
        return half

    def snapshot(self) -> dict[str, Array]:
        """Copies of all fields that may differ."""
        return {name: field.copy() for name, field in self._fields.items()}

    def of(self, index: int) -> dict[str, Array]:
        """The fields of one simulation."""
        return {name: field[index] for name, field in self._fields.items()}

    def set(self, index: int, values: Mapping[str, Array]) -> None:
        """Inverse of `of`."""
        for name, field in self._fields.items():
            field[index] = values[name]
        self._batch.set_const()

    def restore(self, values: Mapping[str, Array]) -> None:
        """Inverse of `snapshot`."""
        for name, field in self._fields.items():
            field[...] = values[name]
        self._batch.set_const()
