"""The terms of the reward, by their dotted path in the recipe's section `task.reward`.

A term is a line here, in any order; longer formulas are in `terms`. Where the recipe gives it a weight and a width, the
line returns squared errors, (n,) or (n, k), and each is scored by a kernel.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.recipe.task.reward import Reward
from iowbc.sim.state import SimulationState
from iowbc.task.motion import Motion
from iowbc.task.rewards import terms
from iowbc.task.rewards.terms import squared_norm


@dataclass(frozen=True)
class Step:
    """Inputs of the terms after a control step of n environments."""

    state: SimulationState
    motion: Motion
    recipe: Reward
    support: slice | Indices
    """Places of the support joints among all joints."""
    lateral: Indices
    """Support joints that do not turn about the lateral axis, among the support joints."""
    command: Array
    """C in force during the step, (n, 11)."""
    target_velocity: Array
    """Planar target velocity: the command's, changed by the force to which the robot yields, (n, 2) [m/s]."""
    unyielded_force: Array
    """Horizontal excess force on the hands to which the robot cannot yield, (n,) [N]; see `Admittance.unyielded`."""
    height_rate: Array
    """Rate of change of the commanded height, (n,) [m/s]."""
    support_reference: Array
    """θ_S_ref in force during the step, gait prior included, (n, 15) [rad]."""
    filtered_velocity: Array
    """Low-passed v_sys, heading frame [m/s], and yaw rate [rad/s], (n, 3)."""
    heading_error: Array
    """Heading less its reference, (n,) [rad]."""
    action: Array
    """a_t, (n, 15)."""
    previous_action: Array
    """a_{t−1}, (n, 15)."""
    earlier_action: Array
    """a_{t−2}, (n, 15)."""
    swing_profile: Array
    """Sole heights of the gait prior, (n, 2) [m]."""
    stepping: Mask
    """True where the gait clock runs, (n,)."""
    commanded: Mask
    """True where a velocity is commanded, (n,)."""
    stance: Mask
    """Feet that should be on the ground, (n, 2)."""
    held: Mask
    """Environments that hold an object, (n,)."""
    pushed: Mask
    """Environments with an object to push, (n,)."""
    object_place: Array
    """Target position of a held object, in a push the middle of the hands; from the base, heading frame, (n, 3) [m]."""
    ended: Mask
    """Environments that fell, lost the object or lagged too far behind the command in this step, (n,)."""

    @property
    def support_error(self) -> Array:
        """θ_S − θ_S_ref, (n, 15) [rad]."""
        return self.state.joint_position[:, self.support] - self.support_reference


Term = Callable[[Step], Array | Mask]

TERMS: dict[str, Term] = {
    "sync.support_reference": lambda s: squared_norm(s.support_error),
    "sync.lateral_reference": lambda s: squared_norm(s.support_error[:, s.lateral]),
    "sync.system_velocity": lambda s: squared_norm(s.filtered_velocity[:, :YAW_RATE] - s.target_velocity),
    "sync.yaw_rate": lambda s: np.square(s.filtered_velocity[:, YAW_RATE] - s.command[:, YAW_RATE]),
    "sync.progress": lambda s: terms.progress(s.filtered_velocity[:, :YAW_RATE], s.target_velocity),
    "sync.turning": lambda s: terms.turning(s.filtered_velocity[:, YAW_RATE], s.command[:, YAW_RATE]),
    "sync.heading": lambda s: np.square(s.heading_error),
    "sync.height": lambda s: np.square(s.motion.height - s.command[:, HEIGHT]),
    "sync.torso_pitch": lambda s: np.square(s.motion.torso_pitch - s.command[:, PITCH]),
    "sync.torso_roll": lambda s: np.square(s.motion.torso_roll),
    "object.position": lambda s: squared_norm(s.motion.object_offset - s.object_place) * s.held,
    "object.orientation": lambda s: terms.tilt(s.state.object_quaternion, s.held),
    "object.link_contact": lambda s: np.minimum(s.state.link_object_force, s.recipe.object.largest_link_contact),
    "object.beside": lambda s: terms.beside(
        s.motion.object_offset, s.object_place, s.recipe.object.largest_beside, s.pushed
    ),
    "object.vertical_velocity": lambda s: np.square(s.state.object_linear_velocity[:, 2] - s.height_rate) * s.held,
    "smooth.joint_acceleration": lambda s: squared_norm(s.state.joint_acceleration),
    "smooth.action_rate": lambda s: squared_norm(s.action - s.previous_action),
    "smooth.action_curvature": lambda s: squared_norm(s.action - 2.0 * s.previous_action + s.earlier_action),
    "smooth.effort": lambda s: terms.effort(
        s.state.joint_torque, s.state.torque_limit, s.recipe.smooth.comfortable_effort
    ),
    "smooth.power": lambda s: terms.power(s.state.joint_torque, s.state.joint_velocity),
    "smooth.base_rates": lambda s: squared_norm(s.state.base_angular_velocity[:, :2]),
    "smooth.vertical_velocity": lambda s: np.square(s.motion.base_velocity[:, 2] - s.height_rate),
    "smooth.saturation": lambda s: terms.saturation(s.state.saturation[:, s.support]),
    "gait.contact_timing": lambda s: terms.contact_timing(s.state.foot_contact, s.stance),
    "gait.swing_height": lambda s: terms.swing_height(s.state.foot_position[:, :, 2], s.swing_profile, ~s.stance),
    "gait.foot_slip": lambda s: terms.foot_slip(s.state.foot_velocity, s.state.foot_force),
    "gait.touchdown": lambda s: terms.touchdown(
        s.state.foot_position[:, :, 2], s.state.foot_velocity[:, :, 2], s.recipe.gait.touchdown_height
    ),
    "gait.standing": lambda s: (~s.state.foot_contact).sum(axis=1) * ~s.stepping,
    "gait.recovery": lambda s: s.stepping & ~s.commanded,
    "gait.foot_distance": lambda s: terms.foot_distance(s.motion.foot_position, s.recipe.gait.smallest_foot_distance),
    "yielding.force": lambda s: s.unyielded_force,
    "alive": lambda s: np.ones(len(s.command)),
    "termination": lambda s: s.ended,
}
"""The terms; their weights are rewards per second."""
ONCE = ("termination",)
"""Terms whose weights are rewards per event instead."""
TRACKED = ("sync.height", "sync.torso_pitch")
"""Terms with a kernel whose scores measure how well the posture is tracked."""
