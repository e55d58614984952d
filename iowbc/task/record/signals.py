"""Signals recorded in each step: those of a trial's metrics, and those that the environments report."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal, get_type_hints

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, PITCH, VELOCITY
from iowbc.robot.description import Robot
from iowbc.task.rewards import terms

if TYPE_CHECKING:
    from iowbc.sim.simulation import Simulation
    from iowbc.sim.state import SimulationState
    from iowbc.task.episode_state import EpisodeState
    from iowbc.task.judge import Ending
    from iowbc.task.motion import Motion
    from iowbc.task.vector.shared import Buffers

TORSO_CENTRE = 0.25
"""Distance along the torso from the pelvis to the point recorded as the torso's position [m]."""


@dataclass(frozen=True)
class Recorded:
    """Inputs of the signals: the step just made by n environments, before an automatic reset."""

    simulation: "Simulation"
    motion: "Motion"
    memory: "EpisodeState"
    ending: "Ending"
    correction: Array
    """Offset that the action adds to the references of the support joints, (n, support) [rad]."""
    period: float
    """Control period [s]."""

    @property
    def state(self) -> "SimulationState":
        return self.simulation.state

    @cached_property
    def soles(self) -> dict[str, Array]:
        return self.simulation.soles


@dataclass(frozen=True)
class Signal:
    """A signal of every step."""

    size: int | Literal["joints", "support"]
    """Number of values; "joints", "support": one for each joint or support joint of the robot."""
    value: Callable[[Recorded], Array | Mask]
    """Its values, (n,) or (n, size) or of more axes, which are flattened."""


class TrialSignal(Signal):
    """A signal only of planned episodes."""


@dataclass(frozen=True)
class Trace:
    """Signals per control step up to the end of the trial, (T,) or (T, k); world frame unless stated otherwise.

    Feet and hands: left, then right. To add a signal, add a line here: it is recorded and reaches every trial's trace.
    """

    dt: float
    """Control period [s]."""
    system_velocity: Annotated[Array, Signal(3, lambda s: s.motion.system_velocity)]
    commanded_velocity: Annotated[Array, Signal(3, lambda s: s.memory.command[:, VELOCITY])]
    """v_sys and the clamped command: v_x, v_y [m/s], yaw rate [rad/s], heading frame, (T, 3)."""
    heading: Annotated[Array, Signal(1, lambda s: s.motion.heading)]
    heading_reference: Annotated[Array, Signal(1, lambda s: s.memory.heading_reference)]
    """Yaw of the base, and integrated commanded yaw rate, (T,) [rad]."""
    torso_pitch: Annotated[Array, Signal(1, lambda s: s.motion.torso_pitch)]
    torso_pitch_command: Annotated[Array, Signal(1, lambda s: s.memory.command[:, PITCH])]
    """Measured pitch and clamped command, (T,) [rad]."""
    pelvis_height: Annotated[Array, Signal(1, lambda s: s.motion.height)]
    height_command: Annotated[Array, Signal(1, lambda s: s.memory.command[:, HEIGHT])]
    """Measured height, of the point that the command H refers to, and clamped command, (T,) [m]."""
    saturation: Annotated[Array, Signal(1, lambda s: terms.saturation(s.state.saturation))]
    """Fraction of the joints at their torque limit, (T,)."""
    slipped: Annotated[Array, Signal(1, lambda s: (s.state.has_object[:, None] & ~s.state.grasped).any(axis=1))]
    """1 while a hand does not hold the object, or in a push does not touch it, (T,)."""
    partner_force: Annotated[Array, Signal(3, lambda s: s.state.partner_force)]
    external_force: Annotated[Array, TrialSignal(3, lambda s: s.state.external_force[:, :3])]
    """Forces on the object: of the partner, and the sum of partner, impulses and pulls, (T, 3) [N]."""
    link_object_force: Annotated[Array, TrialSignal(1, lambda s: s.state.link_object_force)]
    """Magnitude of the net force of links other than the hands on the object, (T,) [N]."""
    grip_force: Annotated[Array, Signal(6, lambda s: s.state.grip_force)]
    """Force of the object on each hand, (T, 6) [N]."""
    handle_displacement: Annotated[Array, TrialSignal(3, lambda s: s.simulation.partner.handle_displacement)]
    """Displacement of the object's far handle in each period, zero without an object, (T, 3) [m]."""
    partner_velocity: Annotated[Array, TrialSignal(3, lambda s: s.state.partner_velocity)]
    """Velocity of the handle that the partner intends; zero without one, (T, 3) [m/s]."""
    power: Annotated[Array, Signal(1, lambda s: terms.power(s.state.joint_torque, s.state.joint_velocity))]
    """Sum over the joints of |torque x speed|, (T,) [W]."""
    base_position: Annotated[Array, Signal(3, lambda s: s.state.base_position)]
    torso_position: Annotated[
        Array, TrialSignal(3, lambda s: s.state.base_position + TORSO_CENTRE * s.state.torso_rotation[:, :, 2])
    ]
    object_position: Annotated[Array, TrialSignal(3, lambda s: s.state.object_position)]
    """Position of base, a point in the torso, and object (zero without one), (T, 3) [m]."""
    foot_position: Annotated[Array, TrialSignal(6, lambda s: s.state.foot_position)]
    """Sole centres, (T, 6) [m]."""
    foot_slide: Annotated[Array, TrialSignal(2, lambda s: s.soles["foot_slide"])]
    foot_sink: Annotated[Array, TrialSignal(2, lambda s: s.soles["foot_sink"])]
    """Horizontal speed of each sole at its centre of pressure, downward speed of its lowest corner, (T, 2) [m/s]."""
    foot_margin: Annotated[Array, TrialSignal(2, lambda s: s.soles["foot_margin"])]
    """Distance of each foot's centre of pressure from the edge of its sole, zero in the air, (T, 2) [m]."""
    foot_peak: Annotated[Array, TrialSignal(2, lambda s: s.soles["foot_peak"])]
    foot_load: Annotated[Array, TrialSignal(2, lambda s: s.state.foot_force[:, :, 2])]
    foot_shear: Annotated[Array, TrialSignal(2, lambda s: np.hypot(*s.state.foot_force[:, :, :2].T).T)]
    """Ground force on each foot: peak over physics steps of the period, vertical, horizontal magnitude, (T, 2) [N]."""
    foot_contact: Annotated[Array, Signal(2, lambda s: s.state.foot_contact)]
    """1 while a foot touches the ground, (T, 2)."""
    action: Annotated[Array, TrialSignal("support", lambda s: s.correction)]
    """Residual that the action adds to the reference of the support joints, (T, support) [rad]."""
    joint_torque: Annotated[Array, TrialSignal("joints", lambda s: s.state.joint_torque)]
    joint_saturation: Annotated[Array, TrialSignal("joints", lambda s: s.state.saturation)]
    """Torque [N·m], and 1 while a joint is at its limit, (T, joints)."""

    def __len__(self) -> int:
        return len(self.heading)


RECORDED: dict[str, Signal] = {
    name: hint.__metadata__[0] for name, hint in get_type_hints(Trace, include_extras=True).items() if name != "dt"
}
SIGNALS = RECORDED | {
    "fallen": Signal(1, lambda s: s.ending.fallen),
    "dropped": Signal(1, lambda s: s.ending.dropped),
    "lagging": Signal(1, lambda s: s.ending.lagging),
    "diverged": Signal(1, lambda s: s.ending.diverged),
    "phase": Signal(1, lambda s: s.memory.phase),
    "level": Signal(4, lambda s: s.memory.level),
    "time": Signal(1, lambda s: s.memory.steps * s.period),
}
"""All signals: also reasons for the end of an episode, gait phase in [0, 1), curriculum levels, episode time [s]."""


def signal_sizes(robot: Robot, *, planned: bool) -> dict[str, int]:
    """Sizes by name, of planned episodes or of others."""
    return {
        name: signal.size if isinstance(signal.size, int) else len(getattr(robot, signal.size))
        for name, signal in SIGNALS.items()
        if planned or not isinstance(signal, TrialSignal)
    }


def write_signals(buffers: "Buffers", step: Recorded, *, planned: bool) -> None:
    """Writes the signals of the step just made; `planned`: with those only of planned episodes."""
    for name, signal in SIGNALS.items():
        if planned or not isinstance(signal, TrialSignal):
            values = signal.value(step)
            buffers[f"signal/{name}"][:] = values.reshape(len(values), -1)
