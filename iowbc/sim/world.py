"""The environments of one scene: a model, and a batch of simulations of it stepped in one call."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from iowbc.arrays import Array, Indices, Mask, as_slice
from iowbc.control.layout import EVERY
from iowbc.errors import UsageError
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.simulation.scene import Scene
from iowbc.recipe.simulation.simulation import Physics
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY, Robot
from iowbc.sim.model import BASE_ANGULAR, BASE_LINEAR, ModelIndex, compile_scene, require_stable
from iowbc.sim.model_fields import ModelFields
from iowbc.sim.object_forces import Grip, Rolling, Squeeze
from iowbc.sim.objects import HANDS as HAND_BODIES
from iowbc.sim.objects import measured
from iowbc.sim.soles import Soles
from iowbc.sim.state import Period, SimulationState
from iowbc.sim.timing import Timing

POSITION = mujoco.mjtStage.mjSTAGE_POS.value
VELOCITY = mujoco.mjtStage.mjSTAGE_VEL.value
NOTHING = mujoco.mjtStage.mjSTAGE_NONE.value
MOTION_ALONE = sum(
    getattr(mujoco.mjtDisableBit, f"mjDSBL_{part}").value for part in ("CONTACT", "CONSTRAINT", "SENSOR", "ACTUATION")
)
"""Flags that disable all of MuJoCo but positions, velocities and inertia of the bodies."""
FEET, HANDS, THING = slice(0, 2), slice(2, 4), 4
"""Places of the bodies whose forces are kept."""
AT_LIMIT = 0.999
"""Part of the torque limit at which a motor counts as saturated."""
PALM_OVERLAP = 0.001
"""Depth by which palms start inside the object that they squeeze [m]."""


class World:
    """n simulations of one scene, and their place among all environments.

    All share one `mjData`, which stays in the processor's cache. Positions and velocities of a new state are computed
    twice: for the observation, without contacts and constraints, and in the next step. That costs less than an `mjData`
    per simulation, which could keep them but is fetched from memory every time.
    """

    def __init__(self, robot: Robot, physics: Physics, scene: Scene, rows: Indices, timing: Timing) -> None:
        self.scene, self.physics, self.rows, self.timing, self._robot = scene, physics, rows, timing, robot
        self.place: slice | Indices = as_slice(rows)
        self.model = compile_scene(robot, physics, scene, timing)
        if physics.pd == "explicit":
            require_stable(self.model, robot, timing)
        self.layout = ModelIndex(self.model, robot)
        self.batch = Batch(self.model, len(rows), nthread=1)
        self.fields = ModelFields(self.batch, self.layout, scene, timing)
        self._flags = self.batch.expand("opt.disableflags")
        self._whole = self._flags.copy()
        self._light = self._whole | MOTION_ALONE
        bind = self.batch.bind
        self.qpos, self.qvel, self.control = bind("qpos"), bind("qvel"), bind("ctrl")
        self._applied, self._connected = bind("xfrc_applied"), bind("eq_active")
        self._last_torque, self._last_external = bind("actuator_force"), bind("cfrc_ext")
        bodies, thing = np.arange(self.model.nbody), [] if self.layout.object is None else [self.layout.object]
        self._touched = np.concatenate([bodies[self.layout.feet], bodies[self.layout.hands], bodies[thing]])
        self._torque, self._external = self._last_torque.copy(), self._last_external[:, self._touched]
        """Torques of the motors; contact torques and forces on `FEET`, `HANDS`, `THING`, in the last physics step."""
        self._body_position, self._body_quaternion, self._body_rotation = bind("xpos"), bind("xquat"), bind("xmat")
        self._inertia = bind("M")
        self._momentum_speeds = slice(3, self.layout.joint_speeds.stop)
        self._momentum = self.model.M_rowadr[self._momentum_speeds] + np.arange(3)[:, None]
        """Entries of the inertia matrix that couple the base's translation to the robot's other speeds, (3, speeds)."""
        kept, history = timing.kept_targets, bind("history")
        targets = history[:, : self.model.nu * (2 + 2 * kept)].reshape(len(rows), -1, 2 + 2 * kept)
        self._past_targets = targets[..., 2 + kept :]
        """The history begins with two counters, times and targets of each motor."""
        past_ground = _force_history(self.model, history, robot.sole_bodies)
        self.soles = Soles(robot, self.batch, self.layout, self._external[:, FEET], past_ground, physics.contact_force)
        if self.layout.object is not None:
            self._past_forces = _force_history(self.model, history, HAND_BODIES)
        self._spatial_velocity, self._subtree_com, self._sites = bind("cvel"), bind("subtree_com"), bind("site_xpos")
        self._centres = bind("xipos")
        self._squeeze, self._grip = self._grasp(scene)
        self._rolling = Rolling(self.batch, self.layout, self.fields, scene) if scene.kind == "push" else None
        self._memory: dict[str, Array] = {} if self._rolling is None else {"touch": self._rolling.touch}
        if self._grip is not None:
            self._memory |= {"grip_angle": self._grip.angle, "grip_rate": self._grip.rate}
        self._warning_counts = self.batch.warning[:, :, 1]
        self._warnings = self._warning_counts.copy()
        self.before = self.batch.state.copy()
        self._mass_cache()

    def _grasp(self, scene: Scene) -> tuple[Squeeze | None, Grip | None]:
        """Forces of arms and palms on a held object, besides their connection or contact with it."""
        if scene.kind != "lift" or scene.object is None:
            return None, None
        if self.layout.palms is not None:
            return Squeeze(self._robot, self.batch, "geom_xpos", as_slice(self.layout.palms)), None
        grip = Grip(self.batch, self.layout, scene.object, scene.grasp, self.timing.period)
        pressed = scene.grasp.by_friction > 0.0
        return Squeeze(self._robot, self.batch, "site_xpos", self.layout.grips) if pressed else None, grip

    def _mass_cache(self) -> None:
        self.robot_mass = np.ascontiguousarray(self.fields.body_mass[:, self.layout.links]).sum(axis=1)
        thing = self.fields.object_mass
        self._object_part = (thing / (thing + self.robot_mass))[:, None]

    def reset(self, ids: Indices, joint_position: Array, pitch: Array, drawn: Mapping[str, Array]) -> None:
        """Robot in the posture, lowest sole corner on the ground; object in the hands or crate in front of them. `ids`
        (k,) in ascending order; all else has a row for each."""
        yaw = drawn["start_yaw"]
        self.batch.reset(ids, stage=NOTHING)
        self.fields.write(ids, drawn)
        self.qpos[ids, :3] = (0.0, 0.0, 1.0)
        self.qpos[ids, 3:7] = rotations.from_euler(np.zeros_like(pitch), pitch, yaw)
        self.qpos[ids, self.layout.joints] = joint_position
        self.control[ids] = joint_position - drawn["encoder_bias"]
        self._past_targets[ids] = self.control[ids, :, None]
        self.batch.forward(ids, stage=POSITION)
        drop = self._lowest_sole(ids)
        self.qpos[ids, 2] -= drop
        if self.layout.object_position is not None:
            self._place_object(ids, drop, yaw, drawn["grip_shift"], self.layout.object_position.start)
        self._connected[ids] = 1.0
        for values in self._memory.values():
            values[ids] = 0.0
        self.batch.forward(ids)
        self._keep(ids)
        self._warnings[ids] = self._warning_counts[ids]
        self._mass_cache()

    def _lowest_sole(self, ids: Indices) -> Array:
        """Height of the lowest point of the soles, (k,) [m]."""
        points = self.layout.foot_geoms
        feet = self.model.geom_bodyid[points]
        offset = np.broadcast_to(self.model.geom_pos[points], (len(ids), len(points), 3))
        centre = self._body_position[ids][:, feet] + rotations.rotate(self._body_quaternion[ids][:, feet], offset)
        return np.min(centre[..., 2] - self.model.geom_size[points, 0], axis=1)

    def _place_object(self, ids: Indices, drop: Array, yaw: Array, shift: Array, start: int) -> None:
        turn = rotations.from_euler(np.zeros_like(yaw), np.zeros_like(yaw), yaw)
        hands = self.grips[ids]
        hands[..., 2] -= drop[:, None]
        if self.layout.palms is not None:
            to_palms = np.broadcast_to(self.model.geom_pos[self.layout.palms], hands.shape)
            hands = hands + rotations.rotate(self._body_quaternion[ids][:, self.layout.hands], to_palms)
        in_heading = rotations.rotate_inverse(turn[:, None], hands)
        middle = 0.5 * (in_heading[:, 0] + in_heading[:, 1])
        radius = self.scene.palm_radius
        if self.scene.kind == "push" and self.scene.object is not None:
            front = np.max(in_heading[:, :, 0], axis=1) + radius + self.scene.gap
            middle[:, 0] = front - measured(self.scene.object).low[0]
            self.qpos[ids, start : start + 2] = rotations.rotate(turn, middle)[:, :2]
            self.qpos[ids, start + 2] = yaw
            return
        middle[:, 0] += shift
        middle[:, 2] -= self.scene.grasp.height
        self.qpos[ids, start : start + 3] = rotations.rotate(turn, middle)
        self.qpos[ids, start + 3 : start + 7] = turn
        if self.layout.palms is None:
            self.fields.arrays["site_pos"][ids[:, None], self.layout.object_grips] = in_heading - middle[:, None]
        else:
            between = in_heading[:, 0, 1] - in_heading[:, 1, 1]
            self.fields.fit_width(ids, between - 2.0 * (radius - PALM_OVERLAP))

    def step(self, given: Period, diverged: Mask) -> None:
        """One control period. Marks in `diverged` the simulations that diverged, and restores their state before it."""
        np.copyto(self.before, self.batch.state)
        np.copyto(self.control, given.target)
        np.copyto(self.fields.torque_range, given.effort)
        self._applied[:, self.layout.base, :3] = given.push
        if self.layout.object is not None:
            self._handle(given, self.layout.object)
        self._advance(given, diverged)
        self._look()
        self._check(diverged)

    def _advance(self, given: Period, diverged: Mask) -> None:
        try:
            self.batch.step(nstep=self.timing.substeps)
        except SimulationError as error:
            diverged[error.ids] = True
        self._keep()
        if self._rolling is not None:
            self._rolling.observe(given.wrench)

    def _keep(self, ids: Indices | slice = EVERY) -> None:
        """Copies the last forces that MuJoCo computed for some simulations."""
        self._torque[ids] = self._last_torque[ids]
        self._external[ids] = self._last_external[ids].take(self._touched, axis=1)

    def _look(self) -> None:
        """Computes positions, velocities and inertia of the new state."""
        self._flags[:] = self._light
        try:
            self.batch.forward(stage=VELOCITY)
        finally:
            self._flags[:] = self._whole

    def _handle(self, given: Period, thing: int) -> None:
        """Applies the forces on the object, and between it and the hands."""
        layout, applied = self.layout, self._applied
        inertia = self.fields.body_mass[:, thing]
        applied[:, thing] = given.wrench
        applied[:, thing, 2] += GRAVITY * (inertia - self.fields.object_mass)
        if self._rolling is not None:
            self._rolling.turn(given.resistance, given.wrench)
        if self._squeeze is not None:
            inward, points = self._squeeze.add(self.control, given.squeeze)
            if self._grip is not None:
                applied[:, layout.wrists, :3] = -inward
                lever = points - self._centres[:, layout.wrists]
                applied[:, layout.wrists, 3:] = rotations.cross(inward, lever)
        if self._grip is not None:
            torque = self._grip.twist(inertia, given.slip_force, self._connected)
            applied[:, thing, 3:] += torque
            applied[:, layout.hands, 3:] = -0.5 * torque[:, None]

    def _check(self, diverged: Mask) -> None:
        """Marks simulations with a warning, or a speed too high or not finite, and restores the start of the period."""
        counts, fastest = self._warning_counts, self.physics.fastest
        speed = np.abs(self.qvel)
        if speed.max() < fastest and (counts == self._warnings).all() and not diverged.any():
            return
        diverged |= (counts != self._warnings).any(axis=1)
        diverged |= ~(speed.max(axis=1) < fastest)
        np.copyto(self._warnings, counts)
        ids = np.flatnonzero(diverged)
        self.batch.state[ids] = self.before[ids]
        self.batch.forward(ids)
        self._keep(ids)

    def release(self, state: SimulationState, slip_force: Array) -> None:
        """Releases hands whose grip carried more than `slip_force`, (all environments,) [N], in any physics step."""
        if self.scene.kind == "free":
            return
        load = np.vecdot(self._past_forces, self._past_forces).max(axis=2)
        if self.layout.object_grips is None:
            state.grasped[self.place] = load > self.physics.contact_force**2
            return
        limit = slip_force[self.place]
        slipped = load > (limit * limit)[:, None]
        if slipped.any():
            slipped &= self._connected > 0.5
            self._connected[slipped] = 0.0
            state.grasped[self.place] = self._connected > 0.5
        state.slipped[self.place] = slipped

    def gather(self, state: SimulationState) -> None:
        """Writes the simulations' rows of the state."""
        place, layout, qpos, qvel = self.place, self.layout, self.qpos, self.qvel
        state.base_position[place] = qpos[:, :3]
        state.base_quaternion[place] = qpos[:, 3:7]
        state.base_rotation[place] = self._body_rotation[:, layout.base].reshape(-1, 3, 3)
        state.base_linear_velocity[place] = qvel[:, BASE_LINEAR]
        state.base_angular_velocity[place] = qvel[:, BASE_ANGULAR]
        state.joint_position[place] = qpos[:, layout.joints]
        state.joint_velocity[place] = qvel[:, layout.joint_speeds]
        state.joint_torque[place] = self._torque
        ranges = self.fields.torque_range
        limit = np.where(self._torque < 0.0, -ranges[..., 0], ranges[..., 1])
        state.torque_limit[place] = limit
        limit *= AT_LIMIT
        state.saturation[place] = np.abs(self._torque) >= limit
        state.torso_rotation[place] = self._body_rotation[:, layout.torso].reshape(-1, 3, 3)
        com = self._subtree_com[:, layout.base]
        state.com_position[place] = com
        sole = self._sites[:, layout.soles]
        state.foot_position[place] = sole
        spatial = self._spatial_velocity[:, layout.feet]
        state.foot_velocity[place] = spatial[..., 3:] + rotations.cross(spatial[..., :3], sole - com[:, None])
        force = self._external[:, FEET, 3:]
        state.foot_force[place] = force
        state.foot_contact[place] = force[:, :, 2] > self.physics.contact_force
        velocity = self._robot_velocity()
        if layout.object is None:
            state.system_velocity[place] = velocity
        else:
            self._gather_object(state, layout.object, velocity)

    def _robot_velocity(self) -> Array:
        """Velocity of the robot's centre of mass, (n, 3) [m/s]: momentum, in the first rows of M qvel, by mass."""
        momentum = self._inertia.take(self._momentum, axis=1)
        momentum *= self.qvel[:, None, self._momentum_speeds]
        velocity = momentum.sum(axis=2)
        velocity /= self.robot_mass[:, None]
        velocity += self.qvel[:, BASE_LINEAR]
        return velocity

    def _gather_object(self, state: SimulationState, thing: int, robot_velocity: Array) -> None:
        place, spatial, position = self.place, self._spatial_velocity[:, thing], self._body_position[:, thing]
        turning, velocity = spatial[:, :3], spatial[:, 3:]
        state.object_position[place] = position
        state.object_quaternion[place] = self._body_quaternion[:, thing]
        arm = position - self._subtree_com[:, thing]
        state.object_linear_velocity[place] = velocity + rotations.cross(turning, arm)
        state.object_angular_velocity[place] = turning
        common = velocity - robot_velocity
        common *= self._object_part
        common += robot_velocity
        state.system_velocity[place] = common
        grip = self._external[:, HANDS, 3:]
        state.grip_force[place] = grip
        hands = grip[:, 0] + grip[:, 1]
        if self.scene.kind == "lift":
            state.hand_weight_share[place] = hands[:, 2] / (-GRAVITY * self.fields.object_mass)
        hands += self._external[:, THING, 3:]  # other links exert all but the forces of hands, partner and impulses
        hands -= self._applied[:, thing, :3]
        state.link_object_force[place] = np.sqrt(np.vecdot(hands, hands))

    @property
    def grips(self) -> Array:
        """Positions of the grips, (n, 2, 3) [m]."""
        return self._sites[:, self.layout.grips]

    def _arrays(self) -> dict[str, Array]:
        """Complete state of the simulations, which each step overwrites."""
        return {**self._memory, "state": self.batch.state, "warnings": self._warnings, **self.fields.arrays}

    def snapshot(self) -> dict[str, Array]:
        return {name: array.copy() for name, array in self._arrays().items()}

    def restore(self, values: Mapping[str, Array]) -> None:
        """Inverse of `snapshot`: the simulations then continue bit for bit."""
        for name, array in self._arrays().items():
            array[...] = values[name]
        self._derive(np.arange(len(self.rows)))

    def copy(self, source: Indices, to: Indices) -> None:
        """Simulations `to`, (k,), continue from the states of simulations `source`, (k,)."""
        for array in self._arrays().values():
            array[to] = array[source]
        self._derive(to)

    def _derive(self, ids: Indices) -> None:
        """Recomputes all that follows from the state of some simulations, after it was overwritten."""
        self.fields.derive(ids)
        self._warning_counts[ids] = self._warnings[ids]
        self.batch.forward(ids, stage=VELOCITY)
        self._mass_cache()


def make_world(
    robot: Robot, physics: Physics, scene: Scene, rows: Indices, timing: Timing, drake: Drake | None
) -> World:
    """The environments of a scene, stepped by MuJoCo, or by Drake with its settings; UsageError if Drake is missing."""
    if drake is None:
        return World(robot, physics, scene, rows, timing)
    try:
        from iowbc.sim.drake.world import DrakeWorld
    except ModuleNotFoundError as missing:
        if (missing.name or "").partition(".")[0] != "pydrake":
            raise
        raise UsageError("eval.engine: drake is not installed: pip install '.[drake]' in a checkout") from None
    return DrakeWorld(robot, physics, scene, rows, timing, drake)


def _force_history(model: Any, history: Array, names: tuple[str, str]) -> Array:
    """Forces of a pair of sensors in the physics steps of the last control period, (n, 2, substeps, 3) [N]. The history
    of each holds two counters, times and forces."""
    first = model.sensor(names[0]).id
    start, substeps = int(model.sensor_historyadr[first]), int(model.sensor_history[first, 0])
    kept = history[:, start : start + 2 * (2 + 4 * substeps)].reshape(len(history), 2, -1)
    return kept[..., 2 + substeps :].reshape(len(history), 2, substeps, 3)
