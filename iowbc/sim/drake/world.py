"""Environments stepped by Drake over a control period, and those of one scene together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import ModelInstanceIndex, PlanarJoint, QuaternionFloatingJoint

from iowbc.arrays import Array, Indices, Mask
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.simulation.scene import Scene
from iowbc.recipe.simulation.simulation import Physics
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.drake.plant import Plant
from iowbc.sim.model import ModelIndex
from iowbc.sim.soles import Soles
from iowbc.sim.state import Period
from iowbc.sim.timing import Timing
from iowbc.sim.world import FEET, HANDS, THING, World


@dataclass(frozen=True)
class Forces:
    """Forces in the physics steps of a control period, world frame."""

    torque: Array
    """Motor torques in the last step, (joints,) [N·m]."""
    feet: Array
    """On the feet from what they touch: torque about the origin, and force, (2, substeps, 6) [N·m, N]."""
    hands: Array
    """On the hands from the object, (2, substeps, 3) [N]."""
    object: Array
    """On the object in the last step from all it touches but the hands, (3,) [N]."""


class DrakeEnvironment:
    """A plant with its state and inputs."""

    def __init__(self, model: Any, settings: Drake, layout: ModelIndex, *, implicit: bool, yaw_arm: float) -> None:
        """`implicit`: the damping of joint control is integrated implicitly; `yaw_arm`: of the `Scene` [m]."""
        self._model, self._implicit = model, implicit
        self._slow, self._arm = settings.stiction, yaw_arm
        self.plant = plant = Plant(model, settings)
        self.tree = tree = plant.tree
        self._contacts, self._reactions = tree.get_contact_results_output_port(), tree.get_reaction_forces_output_port()
        self._root = plant.diagram.CreateDefaultContext()
        self.context = context = tree.GetMyMutableContextFromRoot(self._root)
        brakes = tree.get_desired_state_input_port(ModelInstanceIndex(1))
        brakes.FixValue(context, np.zeros(brakes.size()))
        self._torques = np.zeros(tree.num_actuators())
        self._actuation = tree.get_actuation_input_port().FixValue(context, self._torques)
        bodies = np.arange(model.nbody)
        self._feet = {int(plant.bodies[body].index()): side for side, body in enumerate(bodies[layout.feet])}
        hands = bodies[layout.hands] if layout.object is not None else ()
        self._hands = [(int(plant.joints[body].index()), plant.bodies[body]) for body in hands]
        self._hand_bodies = {int(hand.index()) for _, hand in self._hands}
        self._object = None if layout.object is None else int(plant.bodies[layout.object].index())
        self._crate = next((joint for joint in plant.joints if isinstance(joint, PlanarJoint)), None)
        self._kp, self._kd = model.actuator_gainprm[:, 0].copy(), -model.actuator_biasprm[:, 2]
        self._passive = np.array([joint.default_damping() for joint in plant.motors])
        self._damped = np.zeros(model.nu, bool)
        self._index(model)

    def _index(self, model: Any) -> None:
        """Maps the plant's positions and velocities to the model's. Those of a floating joint begin with the rotation,
        and its angular velocity is in the world frame."""
        from_position, from_speed = np.zeros(model.nq, np.intp), np.zeros(model.nv, np.intp)
        self._floating: list[tuple[slice, slice]] = []
        for body, joint in enumerate(self.plant.joints):
            if joint is None or not joint.num_velocities():
                continue
            first = int(model.body_jntadr[body])
            position, speed = int(model.jnt_qposadr[first]), int(model.jnt_dofadr[first])
            q, v = np.arange(joint.num_positions()), np.arange(joint.num_velocities())
            floats = isinstance(joint, QuaternionFloatingJoint)
            from_position[joint.position_start() + q] = position + (np.roll(q, 4) if floats else q)
            from_speed[joint.velocity_start() + v] = speed + (np.roll(v, 3) if floats else v)
            if floats:
                self._floating.append((slice(position + 3, position + 7), slice(speed + 3, speed + 6)))
        self._from_position, self._from_speed = from_position, from_speed
        self._motor_position = np.array([joint.position_start() for joint in self.plant.motors])
        self._motor_speed = model.nq + np.array([joint.velocity_start() for joint in self.plant.motors])

    def set_state(self, position: Array, speed: Array) -> None:
        """The state of the model, (nq,) and (nv,)."""
        turned = speed.copy()
        for quaternion, angular in self._floating:
            turned[angular] = rotations.rotate(position[quaternion], speed[angular])
        self.tree.SetPositions(self.context, position[self._from_position])
        self.tree.SetVelocities(self.context, turned[self._from_speed])

    def state(self) -> tuple[Array, Array]:
        position, speed = np.empty(len(self._from_position)), np.empty(len(self._from_speed))
        position[self._from_position] = self.tree.GetPositions(self.context)
        speed[self._from_speed] = self.tree.GetVelocities(self.context)
        for quaternion, angular in self._floating:
            position[quaternion] = rotations.normalized(position[quaternion])
            speed[angular] = rotations.rotate_inverse(position[quaternion], speed[angular])
        return position, speed

    def advance(self, targets: Array, torque_range: Array, applied: Array, held: Mask, resistance: float) -> Forces:
        """One control period from the current state. `targets` of the joint controllers, (substeps, joints) [rad];
        `torque_range` of each motor, (joints, 2) [N·m]; `applied`: force and torque on each body about its centre of
        mass, world frame, (bodies, 6) [N, N·m]; `held`: grips that hold; `resistance`: of a crate's wheels [N]."""
        tree, context, substeps = self.tree, self.context, len(targets)
        for grip, holds in zip(self.plant.grips, held, strict=True):
            tree.SetConstraintActiveStatus(context, grip, bool(holds))
        tree.get_applied_spatial_force_input_port().FixValue(context, self._applied(applied))
        feet, hands, thing = np.zeros((2, substeps, 6)), np.zeros((2, substeps, 3)), np.zeros(3)
        for step, target in enumerate(targets):
            torque = self._drive(target, torque_range)
            if self._crate is not None:
                self._brake(self._crate, resistance)
            self.plant.diagram.ExecuteForcedEvents(self._root)
            thing = self._touch(feet[:, step])
            self._hold(hands[:, step])
        return Forces(torque=torque, feet=feet, hands=hands, object=thing)

    def _applied(self, applied: Array) -> list[Any]:
        forces = []
        for body in np.flatnonzero(applied.any(axis=1)):
            force = ExternallyAppliedSpatialForce()
            force.body_index = self.plant.bodies[body].index()
            force.p_BoBq_B = self._model.body_ipos[body]
            force.F_Bq_W = SpatialForce(tau=applied[body, 3:], f=applied[body, :3])
            forces.append(force)
        return forces

    def _drive(self, target: Array, torque_range: Array) -> Array:
        """Sets the motors for a step; their torques, (joints,) [N·m]. For a motor below its limit, an implicit damping
        of the joint control is passed to Drake as joint damping."""
        state = self.tree.GetPositionsAndVelocities(self.context)
        spring = self._kp * (target - state[self._motor_position])
        torque = spring - self._kd * state[self._motor_speed]
        bounded: Array = np.minimum(np.maximum(torque, torque_range[:, 0]), torque_range[:, 1])
        damped = (bounded == torque) & self._implicit
        for motor in np.flatnonzero(damped != self._damped):
            damping = self._passive[motor] + damped[motor] * self._kd[motor]
            self.plant.motors[motor].SetDamping(self.context, damping)
        self._damped = damped
        self._torques[self.plant.motor_inputs] = np.where(damped, spring, bounded)
        self._actuation.GetMutableData().get_mutable_value().set_value(self._torques)
        return bounded

    def _brake(self, crate: Any, resistance: float) -> None:
        """Rolling resistance -R w / |w| of the crate, w = (x, y, arm · yaw), as implicit damping R / |w| with |w|
        before the step. The limit is the same, but a crate at rest creeps below the speed of regularisation."""
        scale = np.array([1.0, 1.0, self._arm])
        first = crate.velocity_start()
        moving = scale * self.tree.GetVelocities(self.context)[first : first + 3]
        crate.SetDampingVector(self.context, resistance / max(float(np.linalg.norm(moving)), self._slow) * scale**2)

    def _touch(self, feet: Array) -> Array:
        """Sums the contacts of the last step: on the feet, torque about the origin and force, to `feet` (2, 6); on the
        object from all but the hands, (3,)."""
        thing = np.zeros(3)
        contacts = self._contacts.Eval(self.context)
        for index in range(contacts.num_point_pair_contacts()):
            contact = contacts.point_pair_contact_info(index)
            one, other = int(contact.bodyA_index()), int(contact.bodyB_index())
            force = contact.contact_force()
            for body, by, sign in ((one, other, -1.0), (other, one, 1.0)):
                if body in self._feet:
                    (x, y, z), (a, b, c) = contact.contact_point(), sign * force
                    feet[self._feet[body]] += (y * c - z * b, z * a - x * c, x * b - y * a, a, b, c)
                elif body == self._object and by not in self._hand_bodies:
                    thing += sign * force
        return thing

    def _hold(self, hands: Array) -> None:
        """Force of the object on each hand in the last step, which the massless hand passes on, to `hands` (2, 3)."""
        if not self._hands:
            return
        reactions = self._reactions.Eval(self.context)
        for force, (joint, hand) in zip(hands, self._hands, strict=True):
            turn = self.tree.EvalBodyPoseInWorld(self.context, hand).rotation()
            force[:] = -(turn @ reactions[joint].translational())


class DrakeWorld(World):
    """n environments of one scene: Drake steps them, MuJoCo holds parameters and states and computes the kinematics."""

    def __init__(
        self, robot: Robot, physics: Physics, scene: Scene, rows: Indices, timing: Timing, settings: Drake
    ) -> None:
        super().__init__(robot, physics, scene, rows, timing)
        self._settings = settings
        self._steps = Timing(timing.period, settings.timestep, timing.longest_latency)
        n = len(rows)
        self._lag = np.zeros(n, np.intp)
        """Latency of the motors in physics steps, (n,)."""
        self._targets = np.zeros((n, self._steps.kept_targets + self._steps.substeps - 1, len(robot.joints)))
        """Targets of the physics steps of the longest latency and of the last control period, the oldest first."""
        self._memory.update(lag=self._lag, targets=self._targets)
        self._past_forces, self._past_ground = np.zeros((2, n, 2, 1, 3))
        feet, lightest = self._external[:, FEET], physics.contact_force
        self.soles = Soles(robot, self.batch, self.layout, feet, self._past_ground, lightest)
        self._environments: list[DrakeEnvironment] = [None] * n  # type: ignore[list-item]
        self._build(np.arange(n))

    def _build(self, ids: Indices) -> None:
        """Makes the plants of some environments from their models."""
        for index in ids:
            self._environments[index] = DrakeEnvironment(
                self.batch.get_model(index),
                self._settings,
                self.layout,
                implicit=self.physics.pd == "implicit",
                yaw_arm=self.scene.yaw_arm,
            )

    def reset(self, ids: Indices, joint_position: Array, pitch: Array, drawn: Mapping[str, Array]) -> None:
        super().reset(ids, joint_position, pitch, drawn)
        self._lag[ids] = np.round(drawn["action_latency"] * self._steps.substeps)
        self._targets[ids] = self.control[ids, None]
        self._build(ids)

    def _derive(self, ids: Indices) -> None:
        super()._derive(ids)
        self._build(ids)

    def _advance(self, given: Period, diverged: Mask) -> None:
        substeps, targets = self._steps.substeps, self._targets
        targets[:, :-substeps] = targets[:, substeps:]
        targets[:, -substeps:] = self.control[:, None]
        for index, environment in enumerate(self._environments):
            if not diverged[index]:
                diverged[index] = not self._step_one(index, environment, given)

    def _step_one(self, index: int, environment: DrakeEnvironment, given: Period) -> bool:
        """Steps one environment. False if Drake found no solution in a step of the period."""
        last, applied = self._targets.shape[1] - self._lag[index], self._applied[index]
        held = self._connected[index] > 0.5
        targets = self._targets[index, last - self._steps.substeps : last]
        environment.set_state(self.qpos[index], self.qvel[index])
        try:
            forces = environment.advance(targets, given.effort[index], applied, held, float(given.resistance[index]))
        except RuntimeError:
            return False
        self.qpos[index], self.qvel[index] = environment.state()
        self._torque[index] = forces.torque
        external = self._external[index]
        external[FEET] = forces.feet[:, -1]
        self._past_ground[index, :, 0] = _greatest(forces.feet[:, :, 3:])
        if self.layout.object is not None:
            external[HANDS, 3:] = forces.hands[:, -1]
            self._past_forces[index, :, 0] = _greatest(forces.hands)
            external[THING, 3:] = forces.object + applied[self.layout.object, :3] - forces.hands[:, -1].sum(axis=0)
        return True

    def _look(self) -> None:
        super()._look()
        feet, com = self._external[:, FEET], self._subtree_com[:, self.layout.base]
        feet[..., :3] -= rotations.cross(np.broadcast_to(com[:, None], feet[..., 3:].shape), feet[..., 3:])


def _greatest(forces: Array) -> Array:
    """The greatest of the forces (2, substeps, 3) on each of a pair, (2, 3)."""
    return forces[np.arange(2), np.vecdot(forces, forces).argmax(axis=1)]
