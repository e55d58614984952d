"""Records signals and counters of each step."""

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, PITCH, VELOCITY, YAW_RATE
from iowbc.sim.simulation import Simulation
from iowbc.sim.state import SimulationState
from iowbc.task.endings import Ending
from iowbc.task.episode_state import EpisodeState
from iowbc.task.judge import Judgement
from iowbc.task.motion import Motion
from iowbc.task.record.signals import COUNTERS, ERRORS, KINDS
from iowbc.task.rewards import terms
from iowbc.task.vector.shared import Buffers

TORSO_CENTRE = 0.25
"""Distance along the torso from the pelvis to the point recorded as the torso's position [m]."""
COLUMN = {name: index for index, name in enumerate(COUNTERS)}
STANDING, WALKING = (slice(COLUMN[f"{kind}/steps"], COLUMN[f"{kind}/{ERRORS[-1]}"] + 1) for kind in KINDS)
"""Columns of steps and errors."""


def write_signals(
    buffers: Buffers, state: SimulationState, moved: Motion, memory: EpisodeState, ending: Ending, period: float
) -> None:
    """The signals of the step just made, of `period` [s]; see `iowbc.task.record.signals.SIGNALS`."""
    command = memory.command
    columns = {
        "heading": moved.heading,
        "heading_reference": memory.heading_reference,
        "torso_pitch": moved.torso_pitch,
        "torso_pitch_command": command[:, PITCH],
        "pelvis_height": moved.height,
        "height_command": command[:, HEIGHT],
        "saturation": terms.saturation(state.saturation),
        "slipped": (state.has_object[:, None] & ~state.grasped).any(axis=1),
        "fallen": ending.fallen,
        "dropped": ending.dropped,
        "lagging": ending.lagging,
        "diverged": ending.diverged,
        "power": terms.power(state.joint_torque, state.joint_velocity),
        "phase": memory.phase,
        "time": memory.steps * period,
    }
    for name, values in columns.items():
        buffers[f"signal/{name}"][:, 0] = values
    buffers["signal/system_velocity"][:] = moved.system_velocity
    buffers["signal/commanded_velocity"][:] = command[:, VELOCITY]
    buffers["signal/grip_force"][:] = state.grip_force.reshape(-1, 6)
    buffers["signal/partner_force"][:] = state.partner_force
    buffers["signal/base_position"][:] = state.base_position
    buffers["signal/level"][:] = memory.level
    buffers["signal/foot_contact"][:] = state.foot_contact


def write_trial_signals(buffers: Buffers, simulation: Simulation, correction: Array) -> None:
    """The signals that only planned episodes have; see `iowbc.task.record.signals.trial_signals`.

    correction: what the action adds to the reference, (n, support) [rad].
    """
    state, n = simulation.state, simulation.n
    values = simulation.soles | {
        "torso_position": state.base_position + TORSO_CENTRE * state.torso_rotation[:, :, 2],
        "object_position": state.object_position,
        "foot_position": state.foot_position.reshape(n, -1),
        "foot_load": state.foot_force[:, :, 2],
        "foot_shear": np.hypot(state.foot_force[:, :, 0], state.foot_force[:, :, 1]),
        "link_object_force": state.link_object_force[:, None],
        "external_force": state.external_force[:, :3],
        "handle_displacement": simulation.partner.handle_displacement,
        "partner_velocity": state.partner_velocity,
        "joint_torque": state.joint_torque,
        "joint_saturation": state.saturation,
        "action": correction,
    }
    for name, columns in values.items():
        buffers[f"signal/{name}"][:] = columns


def count_step(buffers: Buffers, judgement: Judgement, memory: EpisodeState) -> None:
    counters, tracking = buffers["counters"], judgement.tracking
    buffers["terms"][:] += judgement.terms
    counters[:, COLUMN["steps"]] += 1.0
    counters[:, COLUMN["tracking"]] += tracking.sum(axis=1) / tracking.shape[1]
    moved, command = judgement.motion, memory.command
    errors = np.empty((len(command), 1 + len(ERRORS)))
    errors[:, 0] = 1.0
    away = memory.filtered_velocity[:, :YAW_RATE] - command[:, :YAW_RATE]
    errors[:, 1] = np.sqrt(np.square(away).sum(axis=1))
    errors[:, 2] = judgement.heading_error
    errors[:, 3] = moved.height - command[:, HEIGHT]
    errors[:, 4] = moved.torso_pitch - command[:, PITCH]
    np.abs(errors, out=errors)
    walking = command[:, VELOCITY].any(axis=1, keepdims=True)
    counters[:, STANDING] += errors * ~walking
    counters[:, WALKING] += errors * walking


def count_endings(buffers: Buffers, ending: Ending, causes: dict[str, Mask], which: NDArray[np.intp]) -> None:
    """Adds the episodes that ended, (k,), to the counters; `causes` of falls by name, (n,)."""
    counters = buffers["counters"]
    counters[which, COLUMN["episodes"]] += 1.0
    counters[which, COLUMN["length"]] += buffers["episode_length"][which]
    counters[which, COLUMN["return"]] += buffers["episode_return"][which]
    for cause, found in causes.items():
        counters[which, COLUMN[f"fell/{cause}"]] += found[which]
    for reason, found in ending.reasons().items():
        counters[which, COLUMN[reason]] += found[which]


def count_pushes(buffers: Buffers, pushing: Mask, memory: EpisodeState, which: NDArray[np.intp]) -> None:
    """Counts the pushes that begin, (k,), and the infeasible ones; `pushing`: environments with a push scene, (n,)."""
    counters = buffers["counters"]
    counters[which, COLUMN["pushes"]] += pushing[which]
    counters[which, COLUMN["infeasible"]] += memory.infeasible[which]
