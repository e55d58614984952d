"""The terms of the reward, by their dotted path in the recipe's section `task.reward`.

A term is a function and its line here, in any order. Where the recipe gives it a weight and a width, the function
returns squared errors, (n,) or (n, k), and each is scored by a kernel.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array, Indices, Mask
from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.recipe.task.reward import Reward
from iowbc.sim.state import SimulationState
from iowbc.task.motion import Motion
from iowbc.task.rewards import gait, smooth, sync
from iowbc.task.rewards import object as equilibrium


@dataclass(frozen=True)
class Step:
    """What the terms may look at after a control step of n environments."""

    state: SimulationState
    motion: Motion
    recipe: Reward
    support: slice | NDArray[np.intp]
    """Places of the support joints among all joints."""
    lateral: Indices
    """Support joints that do not turn about the lateral axis, among the support joints."""
    command: Array
    """C in force during the step, (n, 11)."""
    target_velocity: Array
    """Planar velocity asked for: the command's, changed by the force to which the robot yields, (n, 2) [m/s]."""
    unyielded_force: Array
    """Horizontal force on the hands at which the robot should have yielded altogether, and beyond, (n,) [N]."""
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
    """Height at which the gait prior has the soles, (n, 2) [m]."""
    stepping: Mask
    """Whether the gait clock runs, (n,)."""
    commanded: Mask
    """Whether a velocity is commanded, (n,)."""
    stance: Mask
    """Feet that should be on the ground, (n, 2)."""
    held: Mask
    """Environments that hold an object, (n,)."""
    pushed: Mask
    """Environments with an object that hands push, (n,)."""
    object_place: Array
    """Where a held object belongs, in a push the middle of the hands; from the base, heading frame, (n, 3) [m]."""
    ended: Mask
    """Environments that fell or dropped the object in this step, (n,)."""


Term = Callable[[Step], Array | Mask]

TERMS: dict[str, Term] = {
    "sync.support_reference": lambda s: sync.support_reference(
        s.state.joint_position[:, s.support], s.support_reference
    ),
    "sync.lateral_reference": lambda s: sync.support_reference(
        s.state.joint_position[:, s.support][:, s.lateral], s.support_reference[:, s.lateral]
    ),
    "sync.system_velocity": lambda s: sync.system_velocity(s.filtered_velocity[:, :YAW_RATE], s.target_velocity),
    "sync.yaw_rate": lambda s: sync.yaw_rate(s.filtered_velocity[:, YAW_RATE], s.command[:, YAW_RATE]),
    "sync.progress": lambda s: sync.progress(s.filtered_velocity[:, :YAW_RATE], s.target_velocity),
    "sync.turning": lambda s: sync.turning(s.filtered_velocity[:, YAW_RATE], s.command[:, YAW_RATE]),
    "sync.heading": lambda s: sync.heading(s.heading_error),
    "sync.height": lambda s: sync.height(s.motion.height, s.command[:, HEIGHT]),
    "sync.torso_pitch": lambda s: sync.torso_pitch(s.motion.torso_pitch, s.command[:, PITCH]),
    "sync.torso_roll": lambda s: sync.torso_roll(s.motion.torso_roll),
    "object.position": lambda s: equilibrium.position(s.motion.object_offset, s.object_place, s.held),
    "object.orientation": lambda s: equilibrium.orientation(s.state.object_quaternion, s.held),
    "object.link_contact": lambda s: equilibrium.link_contact(
        s.state.link_object_force, s.recipe.object.largest_link_contact
    ),
    "object.beside": lambda s: equilibrium.beside(
        s.motion.object_offset, s.object_place, s.recipe.object.largest_beside, s.pushed
    ),
    "object.vertical_velocity": lambda s: equilibrium.vertical_velocity(
        s.state.object_linear_velocity, s.height_rate, s.held
    ),
    "smooth.joint_acceleration": lambda s: smooth.joint_acceleration(s.state.joint_acceleration),
    "smooth.action_rate": lambda s: smooth.action_rate(s.action, s.previous_action),
    "smooth.action_curvature": lambda s: smooth.action_curvature(s.action, s.previous_action, s.earlier_action),
    "smooth.effort": lambda s: smooth.effort(
        s.state.joint_torque, s.state.torque_limit, s.recipe.smooth.comfortable_effort
    ),
    "smooth.power": lambda s: smooth.power(s.state.joint_torque, s.state.joint_velocity),
    "smooth.base_rates": lambda s: smooth.base_rates(s.state.base_angular_velocity),
    "smooth.vertical_velocity": lambda s: smooth.vertical_velocity(s.motion.base_velocity, s.height_rate),
    "smooth.saturation": lambda s: smooth.saturation(s.state.saturation[:, s.support]),
    "gait.contact_timing": lambda s: gait.contact_timing(s.state.foot_contact, s.stance),
    "gait.swing_height": lambda s: gait.swing_height(s.state.foot_position[:, :, 2], s.swing_profile, ~s.stance),
    "gait.foot_slip": lambda s: gait.foot_slip(s.state.foot_velocity, s.state.foot_force),
    "gait.touchdown": lambda s: gait.touchdown(
        s.state.foot_position[:, :, 2], s.state.foot_velocity[:, :, 2], s.recipe.gait.touchdown_height
    ),
    "gait.standing": lambda s: gait.standing(s.state.foot_contact, s.stepping),
    "gait.recovery": lambda s: s.stepping & ~s.commanded,
    "gait.foot_distance": lambda s: gait.foot_distance(s.motion.foot_position, s.recipe.gait.smallest_foot_distance),
    "yielding.force": lambda s: s.unyielded_force,
    "alive": lambda s: np.ones(len(s.command)),
    "termination": lambda s: s.ended,
}
"""The terms; each counts once a second, times its weight."""
ONCE = ("termination",)
"""Terms that count once when they are due, and not by the second."""
TRACKED = ("sync.height", "sync.torso_pitch")
"""Terms with a kernel whose scores say how well an environment keeps its posture."""
