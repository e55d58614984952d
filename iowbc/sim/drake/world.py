"""The environments of one scene stepped by Drake."""

from collections.abc import Mapping

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.simulation.scene import Scene
from iowbc.recipe.simulation.simulation import Physics
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.drake.environment import DrakeEnvironment
from iowbc.sim.soles import Soles
from iowbc.sim.state import Period
from iowbc.sim.timing import Timing
from iowbc.sim.world import FEET, HANDS, THING, World


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
        self._past_forces, past_ground = np.zeros((n, 2, 1, 3)), np.zeros((n, 2, 1, 3))
        self._past_ground = past_ground
        self.soles = Soles(robot, self.batch, self.layout, self._external[:, FEET], past_ground, physics.contact_force)
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
