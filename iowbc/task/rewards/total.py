"""The weighted sum of all terms, with its parts."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.reward import Reward
from iowbc.sim.state import SimulationState
from iowbc.task.command import HEIGHT, PITCH
from iowbc.task.motion import Motion
from iowbc.task.rewards import gait, smooth, sync
from iowbc.task.rewards import object as equilibrium

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
TRACKING = ("system_velocity", "yaw_rate", "height", "torso_pitch")
"""The scores that say how well an environment tracks."""


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
    """Low-passed v_sys, heading frame, (n, 2) [m/s]."""
    filtered_yaw_rate: Array
    """(n,) [rad/s]."""
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
    """The scores of `TRACKING`, between 0 and 1, (n, 4)."""

    def without(self, which: Mask) -> "Scored":
        """The same with nothing for some environments, (n,): what they did cannot be judged."""
        if not which.any():
            return self
        kept = ~which
        terms = np.where(kept[:, None], self.terms, 0.0)
        tracking = np.where(kept[:, None], self.tracking, 0.0)
        return Scored(reward=np.where(kept, self.reward, 0.0), terms=terms, tracking=tracking)


def score(
    reward: Reward, support: NDArray[np.intp], state: SimulationState, motion: Motion, step: Step, dt: float
) -> Scored:
    """Reward of one control step of `dt` [s]; `support`: indices of the support joints."""
    r_sync, r_object, r_smooth, r_gait = reward.sync, reward.object, reward.smooth, reward.gait
    scores = {
        "support_reference": sync.support_reference(
            state.joint_position[:, support], step.support_reference, r_sync.support_reference.width
        ),
        "system_velocity": sync.system_velocity(
            step.filtered_velocity, step.command[:, :2], r_sync.system_velocity.width
        ),
        "yaw_rate": sync.yaw_rate(step.filtered_yaw_rate, step.command[:, 2], r_sync.yaw_rate.width),
        "height": sync.height(motion.height, step.command[:, HEIGHT], r_sync.height.width),
        "torso_pitch": sync.torso_pitch(motion.torso_pitch, step.command[:, PITCH], r_sync.torso_pitch.width),
    }
    swing = r_gait.swing_height
    parts = (
        *(getattr(r_sync, name).weight * value for name, value in scores.items()),
        r_sync.torso_roll * sync.torso_roll(motion.torso_roll),
        r_object.position * equilibrium.position(motion.object_offset, step.object_place, step.held),
        r_object.orientation * equilibrium.orientation(state.object_quaternion, step.held),
        r_object.vertical_velocity
        * equilibrium.vertical_velocity(state.object_linear_velocity, step.height_rate, step.held),
        r_smooth.joint_acceleration * smooth.joint_acceleration(state.joint_acceleration),
        r_smooth.action_rate * smooth.action_rate(step.action, step.previous_action),
        r_smooth.power * smooth.power(state.joint_torque, state.joint_velocity),
        r_smooth.base_rates * smooth.base_rates(state.base_angular_velocity),
        r_smooth.vertical_velocity * smooth.vertical_velocity(motion.base_velocity, step.height_rate),
        r_smooth.saturation * smooth.saturation(state.saturation[:, support]),
        r_gait.contact_timing * gait.contact_timing(state.foot_contact, step.stance),
        swing.weight
        * gait.swing_height(
            state.foot_position[:, :, 2], step.swing_progress, ~step.stance, r_gait.swing_clearance, swing.width
        ),
        r_gait.foot_slip * gait.foot_slip(state.foot_velocity, state.foot_contact),
        r_gait.foot_distance * gait.foot_distance(motion.foot_position, r_gait.smallest_foot_distance),
        np.full(len(step.command), reward.alive),
    )
    terms = np.empty((len(step.command), len(TERMS)))
    for column, part in enumerate(parts):
        np.multiply(part, dt, out=terms[:, column])
    terms[:, -1] = reward.termination * step.ended
    tracking = np.stack([scores[name] for name in TRACKING], axis=1)
    return Scored(reward=terms.sum(axis=1), terms=terms, tracking=tracking)
