"""Snapshot of an environment for display, independent of the simulation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from iowbc.arrays import Array
from iowbc.control.command import COMMAND
from iowbc.robot import rotations
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import Force, forces
from iowbc.sim.simulation import Simulation
from iowbc.task.batch import Batch


@dataclass(frozen=True)
class Moment:
    """One control step, world frame."""

    seconds: float
    """Time since the start of the episode [s]."""
    bodies: Array
    """Position and quaternion (wxyz) of every body of the model, (bodies, 7)."""
    reference: Array
    """The same for the robot in its reference posture, the base where it is, (bodies, 7)."""
    forces: tuple[Force, ...]
    balance: Array
    """The point of the ground beneath the centre of mass of robot and held object, (3,) [m]."""
    support: Array
    """Corners of the convex hull of the soles that touch the ground, in order, (k, 3) [m]; k is 0 in the air."""
    command: Array
    """Command of the next step, (11,)."""
    signals: Mapping[str, Array]
    """Figures of the step just made, each (k,); in an environment those that a trial records."""


class SimulationRecorder:
    """Takes down the moments of the first environment of a simulation, which know no reference and no command."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._appearance = Appearance(simulation, 0)
        self.model = self._appearance.model
        """Model for drawing: with visual geoms, and the object's size in the current episode."""
        self._world = simulation.world_of(0)[0]
        robot = simulation.robot
        soles = [self.model.body(name).id for name in robot.sole_bodies]
        self._corners = [
            np.flatnonzero((self.model.geom_bodyid == sole) & (self.model.geom_conaffinity != 0)) for sole in soles
        ]
        self._held = self._world.scene.kind == "lift"

    @property
    def held_mass(self) -> float:
        """Mass of the object in the hands [kg]; 0 without one."""
        return float(self._simulation.drawn["object_mass"][0]) if self._held else 0.0

    def look(self, seconds: float) -> Moment:
        data = self._appearance.update()
        bodies = np.hstack([data.xpos, data.xquat])
        return Moment(
            seconds=seconds,
            bodies=bodies,
            reference=bodies,
            forces=tuple(forces(self._simulation, 0)),
            balance=self._balance(),
            support=self._support(data),
            command=np.zeros(len(COMMAND)),
            signals={},
        )

    def _balance(self) -> Array:
        simulation, state = self._simulation, self._simulation.state
        centre: Array = state.com_position[0].copy()
        if self._held:
            offset = rotations.rotate(state.object_quaternion[:1], simulation.drawn["object_com_offset"][:1])[0]
            part = self.held_mass / (self.held_mass + float(self._world.robot_mass[0]))
            centre += part * (state.object_position[0] + offset - centre)
        centre[2] = 0.0
        return centre

    def _support(self, data: Any) -> Array:
        touching = self._simulation.state.foot_contact[0]
        corners = [data.geom_xpos[points, :2] for points, down in zip(self._corners, touching, strict=True) if down]
        if not corners:
            return np.zeros((0, 3))
        points = np.concatenate(corners)
        hull = points[ConvexHull(points).vertices]
        return np.column_stack([hull, np.zeros(len(hull))])


class MomentRecorder(SimulationRecorder):
    """Takes down the moments of the first environment of a batch, in its present episode."""

    def __init__(self, batch: Batch, signals: Mapping[str, Array]) -> None:
        """`signals`: by name, (n, k); the simulation overwrites them in every step."""
        super().__init__(batch.simulation)
        self.batch, self._signals = batch, signals
        self._reference = mujoco.MjData(self.model)

    def look(self, seconds: float) -> Moment:
        moment = super().look(seconds)
        robot, memory, reference = self._simulation.robot, self.batch.memory, self._reference
        reference.qpos[:] = self._appearance.data.qpos
        joints = reference.qpos[self._world.layout.joints]
        joints[robot.support], joints[robot.interaction] = memory.support[0], memory.arms[0]
        mujoco.mj_kinematics(self.model, reference)
        return replace(
            moment,
            reference=np.hstack([reference.xpos, reference.xquat]),
            command=np.array(self.batch.memory.command[0]).reshape(len(COMMAND)),
            signals={name: values[0].copy() for name, values in self._signals.items()},
        )
