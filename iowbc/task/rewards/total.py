"""The weighted sum of all terms, with its parts."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.recipe.task.reward import Kernel, Reward
from iowbc.sim.state import SimulationState
from iowbc.task.motion import Motion
from iowbc.task.rewards import gait, smooth, sync
from iowbc.task.rewards import object as equilibrium
from iowbc.task.rewards.kernel import kernel

Array = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]

TERMS = (
    "sync/support_reference",
    "sync/system_velocity",
    "sync/yaw_rate",
    "sync/height",
    "sync/torso_pitch",
    "sync/torso_roll",
    "object/position",
    "object/orientation",
    "object/vertical_velocity",
    "smooth/joint_acceleration",
    "smooth/action_rate",
    "smooth/power",
    "smooth/base_rates",
    "smooth/vertical_velocity",
    "smooth/saturation",
    "gait/contact_timing",
    "gait/swing_height",
    "gait/foot_slip",
    "gait/foot_distance",
    "alive",
    "termination",
)
"""Names of the terms, in the order of the columns of `Scored.terms`."""
SCORED = slice(0, 5)
"""Columns of the terms that a kernel scores; the swinging feet have a kernel each."""
TRACKED = slice(1, 5)
"""Columns whose scores say how well an environment tracks."""


@dataclass(frozen=True)
class Step:
    """What the reward needs to know of one control step beside state and motion; n environments."""

    command: Array
    """C in force during the step, (n, 11)."""
    height_rate: Array
    """Rate of change of the commanded height, (n,) [m/s]."""
    support_reference: Array
    """θ_S_ref in force during the step, gait prior included, (n, 15) [rad]."""
    filtered_velocity: Array
    """Low-passed v_sys, heading frame [m/s], and yaw rate [rad/s], (n, 3)."""
    action: Array
    """a_t, (n, 15)."""
    previous_action: Array
    """a_{t−1}, (n, 15)."""
    swing_progress: Array
    """(n, 2), see `gait.swing_progress`."""
    stance: Mask
    """Feet that should be on the ground, (n, 2)."""
    held: Mask
    """Environments that hold an object, (n,)."""
    object_place: Array
    """Where a held object belongs, from the base, heading frame, (n, 3) [m]."""
    ended: Mask
    """Environments that fell or dropped the object in this step, (n,)."""


@dataclass(frozen=True)
class Scored:
    """The reward of one step."""

    reward: Array
    """(n,)."""
    terms: Array
    """Each term's part of the reward, (n, len(TERMS))."""
    tracking: Array
    """The scores of the columns `TRACKED`, between 0 and 1, (n, 4)."""

    def without(self, which: Mask) -> "Scored":
        """The same with nothing for some environments, (n,): what they did cannot be judged."""
        if not which.any():
            return self
        kept = ~which
        terms = np.where(kept[:, None], self.terms, 0.0)
        tracking = np.where(kept[:, None], self.tracking, 0.0)
        return Scored(reward=np.where(kept, self.reward, 0.0), terms=terms, tracking=tracking)


class RewardFunction:
    """The reward of a recipe."""

    def __init__(self, reward: Reward, support: slice | NDArray[np.intp], dt: float) -> None:
        """`support`: places of the support joints; `dt`: control period [s]."""
        self._gait, self._support = reward.gait, support
        settings = [_setting(reward, name) for name in TERMS]
        self._weights = np.array([setting.weight if isinstance(setting, Kernel) else setting for setting in settings])
        self._weights[:-1] *= dt
        self._widths = np.array([setting.width for setting in settings[SCORED] if isinstance(setting, Kernel)])

    def __call__(self, state: SimulationState, motion: Motion, step: Step) -> Scored:
        """Reward of one control step."""
        gait_settings, support, command = self._gait, self._support, step.command
        parts = (
            sync.support_reference(state.joint_position[:, support], step.support_reference),
            sync.system_velocity(step.filtered_velocity[:, :YAW_RATE], command[:, :YAW_RATE]),
            sync.yaw_rate(step.filtered_velocity[:, YAW_RATE], command[:, YAW_RATE]),
            sync.height(motion.height, command[:, HEIGHT]),
            sync.torso_pitch(motion.torso_pitch, command[:, PITCH]),
            sync.torso_roll(motion.torso_roll),
            equilibrium.position(motion.object_offset, step.object_place, step.held),
            equilibrium.orientation(state.object_quaternion, step.held),
            equilibrium.vertical_velocity(state.object_linear_velocity, step.height_rate, step.held),
            smooth.joint_acceleration(state.joint_acceleration),
            smooth.action_rate(step.action, step.previous_action),
            smooth.power(state.joint_torque, state.joint_velocity),
            smooth.base_rates(state.base_angular_velocity),
            smooth.vertical_velocity(motion.base_velocity, step.height_rate),
            smooth.saturation(state.saturation[:, support]),
            gait.contact_timing(state.foot_contact, step.stance),
            gait.swing_height(
                state.foot_position[:, :, 2],
                step.swing_progress,
                ~step.stance,
                gait_settings.swing_clearance,
                gait_settings.swing_height.width,
            ),
            gait.foot_slip(state.foot_velocity, state.foot_contact),
            gait.foot_distance(motion.foot_position, gait_settings.smallest_foot_distance),
            np.ones(len(command)),
            step.ended,
        )
        terms = np.empty((len(command), len(TERMS)))
        for column, part in enumerate(parts):
            terms[:, column] = part
        terms[:, SCORED] = kernel(terms[:, SCORED], self._widths)
        tracking = terms[:, TRACKED].copy()
        terms *= self._weights
        return Scored(reward=terms.sum(axis=1), terms=terms, tracking=tracking)


def _setting(reward: Reward, term: str) -> Any:
    """What the recipe says of a term: its weight, or weight and width."""
    setting: Any = reward
    for name in term.split("/"):
        setting = getattr(setting, name)
    return setting
