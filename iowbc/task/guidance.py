"""Guidance of the robots: the command, the gait clock, and the joint references that follow from both."""

from collections.abc import Sequence

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask, as_slice
from iowbc.control.action import action_scale
from iowbc.control.chain import Frames
from iowbc.control.command import HEIGHT
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.control.sensors import Measured
from iowbc.robot.description import Robot
from iowbc.task.commands import Commander
from iowbc.task.episode_state import EpisodeState
from iowbc.task.episodes import CommandScript
from iowbc.task.specification import Specification


class Guidance:
    """Commands, gait clocks and references of n environments, kept in their `EpisodeState`."""

    def __init__(
        self,
        specification: Specification,
        robot: Robot,
        scenes: Sequence[str],
        holding: Mask,
        pushing: Mask,
        scripts: Sequence[CommandScript | None],
    ) -> None:
        """`scenes`: scene of each environment; `holding`: those that begin with an object in the hands, `pushing`: with
        a crate in front of them, (n,)."""
        task = specification.recipe.task
        self._period = 1.0 / task.control_frequency
        self.references = ReferenceLayer(robot, task.references, specification.rg)
        self.commander = Commander(task, self.references, scripts, holding, pushing)
        self.grasp = np.stack([both_wrists(getattr(task.references.grasps, name)) for name in scenes])
        """Base grasp of both wrists, heading frame, (n, 2, 3) [m]."""
        self._load = np.array([getattr(task.references.loads, name) for name in scenes])
        self._frames: Frames | None = None
        """Arm frames at the current references: computed for the targets, reused for the next references."""
        self._support, self._arms = as_slice(robot.support), as_slice(robot.interaction)
        self._joints, self._scale = len(robot.joints), action_scale(robot, task.action)

    def start(self, which: Indices, memory: EpisodeState, key: Keys) -> tuple[Array, Array]:
        """Starts episodes with keys (k,). Returns initial joint positions (k, joints) and base pitch (k,) [rad]."""
        self.commander.start(which, memory, key)
        command = memory.command[which]
        arms, posture = self.references.start(command, self.grasp[which])
        memory.arms[which], memory.posture[which], memory.support[which] = arms, posture, posture
        memory.stepping[which] = False
        halves = np.floor(2.0 * random.uniform(key, "gait/phase", 1)[:, 0])
        memory.phase[which] = np.where(self.commander.scripted[which], 0.0, 0.5 * halves)
        memory.height_rate[which], memory.feedback[which] = 0.0, 0.0
        return self.joints(posture, arms), self.references.start_pitch(posture, command)

    def advance(self, memory: EpisodeState, key: Keys, measured: Measured) -> None:
        """Command, references and gait clock of the next step; keys of the episodes, (n,)."""
        period = self._period
        height = memory.command[:, HEIGHT].copy()
        self.commander.advance(memory, key)
        memory.height_rate[:] = (memory.command[:, HEIGHT] - height) / period
        arms, posture = self.references.advance(
            memory.arms, memory.posture, memory.command, self.grasp, period, self._frames
        )
        self._frames = None
        memory.arms[:], memory.posture[:] = arms, posture
        phase, stepping, feedback = self.references.pace(
            memory.phase, memory.stepping, memory.feedback, measured, posture, memory.command, period
        )
        memory.phase[:], memory.stepping[:], memory.feedback[:] = phase, stepping, feedback
        memory.support[:] = self.references.with_stride(posture, memory.command, phase, stepping, feedback)

    def targets(self, memory: EpisodeState, action: Array) -> Array:
        """Joint targets of an action (n, 15) within its bounds, (n, joints) [rad]: θ_S_ref + scale·a, θ_I_ref."""
        self._frames = self.references.arms.frames(memory.arms)
        arms = self.references.arm_target(memory.arms, memory.posture, memory.command, self._load, self._frames)
        return self.joints(memory.support + self._scale * action, arms)

    def joints(self, support: Array, arms: Array) -> Array:
        """Values of both branches in MJCF order, (n, joints)."""
        values = np.empty((len(arms), self._joints))
        values[:, self._support], values[:, self._arms] = support, arms
        return values

    def object_place(self, memory: EpisodeState) -> Array:
        """Target position of a held object from the base, heading frame, (n, 3) [m]: it follows the wrist targets."""
        wrists = self.references.wrists(memory.command, self.grasp)
        return 0.5 * (wrists[:, 0] + wrists[:, 1]) + memory.object_place
