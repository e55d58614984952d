"""Writes the rows of s_t and s_priv."""

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Indices, as_slice
from iowbc.control import gait
from iowbc.control.layout import EVERY
from iowbc.control.observation import Sensed
from iowbc.control.sensors import Measured
from iowbc.robot.description import Robot
from iowbc.sim.simulation import Simulation
from iowbc.task.layout import FullLayout
from iowbc.task.memory import Memory
from iowbc.task.motion import Motion
from iowbc.task.privileged import Truth


class Observer:
    """Writes what policy and critic see of a simulation's environments."""

    def __init__(self, robot: Robot, layout: FullLayout, simulation: Simulation, memory: Memory) -> None:
        self._layout, self._support, self._arms = layout, as_slice(robot.support), as_slice(robot.interaction)
        self._simulation, self._memory = simulation, memory
        self.measured = Measured.of(simulation.measured)
        self._joint_reference = np.tile(robot.default_position, (simulation.n, 1))

    def write(self, rows: NDArray[np.float32], moved: Motion, which: Indices | slice = EVERY) -> None:
        """Writes the rows of some environments among all, (n, layout.size)."""
        memory, simulation = self._memory, self._simulation
        self._joint_reference[:, self._support] = memory.support
        self._joint_reference[:, self._arms] = memory.arms
        sensed = Sensed(
            measured=self.measured,
            command=memory.command,
            heading_reference=(memory.heading_reference + memory.heading_offset)[:, None],
            joint_reference=self._joint_reference,
            phase=gait.phase_signal(memory.phase, memory.stepping),
            last_action=memory.action,
            support_reference=memory.support,
            arm_reference=memory.arms,
        )
        layout = self._layout
        seen = np.empty((len(moved.heading[which]), layout.size), np.float32)
        layout.state.gather(sensed, seen[:, layout.observation], which)
        layout.extra.gather(
            Truth(moved, simulation.state, simulation.drawn, simulation.motor_effort), seen[:, layout.privileged], which
        )
        rows[which] = seen
