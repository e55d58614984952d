"""Whether joint damping that is computed from the state before a physics step lets the joints come to rest."""

from typing import Any

import mujoco
import numpy as np

from iowbc.robot.description import Robot
from iowbc.sim.timing import Timing


def require_stable(model: Any, robot: Robot, timing: Timing) -> None:
    """Raises ValueError where kd dt / I of a joint passes 1: its speed would then change sign at every step.

    I: inertia that the joint feels with all others free, 1 / (M⁻¹)_jj, in the default posture.
    """
    data = mujoco.MjData(model)
    count = len(robot.joints)
    data.qpos[7 : 7 + count] = robot.default_position
    mujoco.mj_forward(model, data)
    inverse = np.zeros((count, model.nv))
    mujoco.mj_solveM(model, data, inverse, np.eye(count, model.nv, 6))
    rate = robot.kd * inverse[np.arange(count), 6 + np.arange(count)]
    worst = int(np.argmax(rate))
    if rate[worst] * timing.timestep > 1.0:
        raise ValueError(
            f"simulation.physics.pd: explicit at a step of {timing.timestep:g} s makes {robot.joints[worst]} buzz: "
            f"kd dt / I is {rate[worst] * timing.timestep:.2f}, it must not pass 1; choose "
            f"simulation.physics.timestep: {timing.longest_stable_step(rate[worst]):g} or shorter"
        )
