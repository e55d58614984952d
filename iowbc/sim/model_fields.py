"""The parameters of a batch's models that differ between its simulations."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.simulation.scene import Scene
from iowbc.sim.model import ModelIndex
from iowbc.sim.objects import measured
from iowbc.sim.timing import Timing

FIELDS = (
    *("body_mass", "body_inertia", "body_ipos", "dof_damping", "dof_frictionloss", "geom_friction"),
    *("actuator_gainprm", "actuator_biasprm", "site_pos", "geom_size", "geom_rbound", "geom_aabb"),
    *("actuator_forcerange", "actuator_delay"),
)
"""Model fields that differ between simulations."""
WHEELS = ("tendon_frictionloss", "tendon_damping", "wrap_prm")
"""Further fields that differ for a crate's wheels."""
STEPPED = ("actuator_forcerange", *WHEELS)
"""Fields that are written in each control period; an episode begins with their nominal values."""


class ModelFields:
    """The parameters of a batch's models that differ between its simulations; writes what was drawn."""

    def __init__(self, batch: Any, layout: ModelIndex, scene: Scene, timing: Timing) -> None:
        self._layout, self._scene, self._timing = layout, scene, timing
        names = FIELDS + WHEELS * (scene.kind == "push")
        self.arrays: dict[str, Array] = {name: batch.expand(name) for name in names}
        """All fields that may differ."""
        self._nominal = {name: field[0].copy() for name, field in self.arrays.items()}
        self.body_mass: Array = self.arrays["body_mass"]
        """Inertial masses, (n, bodies) [kg]."""
        self.object_mass = self.arrays["object_mass"] = np.zeros(len(self.body_mass))
        """Gravitational mass, (n,) [kg]; the inertial one of a light object (`body_mass`) is larger."""
        self.torque_range: Array = self.arrays["actuator_forcerange"]
        """Least and greatest torque of each motor, (n, joints, 2) [N·m]; to be written."""
        self.rolling = [self.arrays[name] for name in names if name in WHEELS]
        """Of a crate's wheels in three directions, to be written: dry friction [N] and damping [N·s/m], (n, 3), and the
        directions, x, y and yaw of each, (n, 9)."""
        self._least_inertia = scene.object.smallest_inertia if scene.object is not None else 0.0
        self._object_inertia = measured(scene.object).principal if scene.object is not None else np.zeros(3)
        batch.set_const()
        self._batch = batch
        self._yielding = batch.expand("tendon_invweight0") if scene.kind == "push" else None

    def write(self, ids: Indices, drawn: Mapping[str, Array]) -> None:
        """Sets the models of simulations `ids`, in ascending order, from rows of drawn values in the same order."""
        links, speeds = self._layout.links, self._layout.joint_speeds
        fields, nominal = self.arrays, self._nominal
        mass = drawn["link_mass_scale"]
        rows = ids if isinstance(links, slice) else ids[:, None]
        fields["body_mass"][rows, links] = nominal["body_mass"][links] * mass
        inertia = mass * drawn["link_inertia_scale"]
        fields["body_inertia"][rows, links] = nominal["body_inertia"][links] * inertia[..., None]
        fields["dof_damping"][ids, speeds] = drawn["motor_damping"]
        fields["dof_frictionloss"][ids, speeds] = drawn["joint_friction"]
        fields["actuator_gainprm"][ids, :, 0] = nominal["actuator_gainprm"][:, 0] * drawn["kp_scale"]
        fields["actuator_biasprm"][ids, :, 1] = nominal["actuator_biasprm"][:, 1] * drawn["kp_scale"]
        fields["actuator_biasprm"][ids, :, 2] = nominal["actuator_biasprm"][:, 2] * drawn["kd_scale"]
        fields["actuator_delay"][ids] = self._timing.delay(drawn["action_latency"])[:, None]
        fields["geom_friction"][ids[:, None], self._layout.foot_geoms, 0] = drawn["ground_friction"][:, None]
        for name in fields.keys() & STEPPED:
            fields[name][ids] = nominal[name]
        if self._layout.object is not None:
            self._write_object(ids, drawn)
        self.derive(ids)

    def derive(self, ids: Indices) -> None:
        """Recomputes derived constants; the compliance of wheels does not depend on their last direction."""
        self._batch.set_const(ids)
        if self._yielding is not None:
            self._yielding[ids] = 1.0 / self.body_mass[ids, self._layout.object][:, None]

    def _write_object(self, ids: Indices, drawn: Mapping[str, Array]) -> None:
        fields, thing = self.arrays, self._layout.object
        fields["object_mass"][ids] = drawn["object_mass"]
        mass = np.maximum(drawn["object_mass"], self._least_inertia)
        inertia = self._object_inertia * (mass * drawn["inertia_scale"])[:, None]
        fields["body_mass"][ids, thing] = mass
        fields["body_inertia"][ids, thing] = inertia
        fields["body_ipos"][ids, thing] = drawn["object_com_offset"]
        if self._layout.palms is not None:
            friction = drawn["surface_friction"][:, None]
            fields["geom_friction"][ids[:, None], self._layout.palms, 0] = friction
            fields["geom_friction"][ids[:, None], self._layout.palms, 1] = self._scene.grasp.torsion * friction

    def fit_width(self, ids: Indices, width: Array) -> None:
        """Makes the object as wide as the space between the palms, (k,) [m]."""
        geom = self._layout.object_geom
        half = self.arrays["geom_size"][ids, geom]
        half[:, 1] = 0.5 * width
        self.arrays["geom_size"][ids, geom] = half
        self.arrays["geom_rbound"][ids, geom] = np.sqrt(np.sum(half * half, axis=1))
        self.arrays["geom_aabb"][ids, geom, 3:] = half
