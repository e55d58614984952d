"""The model-based rival: a quadratic program that balances on both feet."""

from typing import Annotated

from pydantic import Field

from iowbc.recipe.section import NonNegative, Positive, Section

Share = Annotated[float, Field(gt=0, le=1)]


class Tracking(Section):
    """A task: an acceleration of stiffness · error − damping · velocity, with the cost ½·weight·(deviation)²."""

    weight: Positive
    """Cost of a deviation from the wanted acceleration [s⁴/m² or s⁴/rad²]."""
    stiffness: NonNegative
    """Acceleration for each unit of error [1/s²]."""
    damping: NonNegative
    """Acceleration against each unit of velocity [1/s]."""


class Estimation(Section):
    """A Kalman filter of tilt and joints: what it assumes of the sensors, and of the model."""

    position_noise: NonNegative = 0.01
    """Standard deviation of measured joint positions [rad]."""
    velocity_noise: NonNegative = 0.5
    """Standard deviation of measured joint velocities [rad/s]."""
    gravity_noise: NonNegative = 0.02
    """Standard deviation of the measured direction of gravity [rad]."""
    gyro_noise: NonNegative = 0.1
    """Standard deviation of the measured angular velocity of the base [rad/s]."""
    model_error: Positive = 3.0
    """Standard deviation of what the planned acceleration misses in a control period [rad/s²]."""
    load_drift: Positive = 5.0
    """Speed at which what the plan misses steadily may change, such as a load's doing [rad/s² per √s]. The estimate
    takes it into account, the program does not."""


class ModelBased(Section):
    """A whole-body quadratic program that stands, crouches and leans on both feet; it does not walk.

    Its model is the nominal robot without a load. It sees the same observation as the student and acts through the same
    joint controllers.
    """

    com: Tracking = Tracking(weight=100.0, stiffness=40.0, damping=10.0)
    """Horizontal centre of mass, over the middle of the soles. Stiffness · height / gravity is 2.9: three times what
    gravity takes. Above 60 the noise of tilt and joints makes it sway from foot to foot."""
    height: Tracking = Tracking(weight=100.0, stiffness=80.0, damping=14.0)
    """Height of the pelvis. As heavy as the centre of mass: below, it lowers itself to hold the torso up."""
    torso: Tracking = Tracking(weight=5.0, stiffness=250.0, damping=29.0)
    """Orientation of the torso: commanded pitch, no roll, the mean yaw of the soles. Stiff, for the load in the hands
    bends it and the program does not know of it."""
    posture: Tracking = Tracking(weight=0.4, stiffness=44.0, damping=12.0)
    """Support joints, towards the same reference θ_S_ref that the learnt policies correct."""
    torque_weight: Positive = 1e-3
    """Joint torques [1/(N·m)²]; decides how the feet share what the tasks leave open."""
    contact_damping: NonNegative = 24.0
    """Acceleration of the soles against their own velocity [1/s]: they come to rest within a few periods."""
    lead: NonNegative = 0.02
    """Time by which the program looks ahead [s]: the mean latency of sensors and actions together, as drawn."""
    estimation: Estimation = Estimation()
    """Estimation of its motion."""
    friction: Positive = 0.5
    """Friction coefficient of the soles that the program may use; the least that the simulation draws."""
    sole_fraction: Share = 0.9
    """Part of the sole's rectangle within which each centre of pressure stays."""
    smallest_load: NonNegative = 20.0
    """Least normal force on each foot [N]."""
    limit_margin: NonNegative = 0.02
    """Distance kept from joint limits [rad]."""
    limit_time: Positive = 0.1
    """Time within which no joint may reach its limit at the planned acceleration [s]."""
    effort_fraction: Share = 0.95
    """Part of the torque limits that the program may use."""
    linkage_share: Share = 0.9
    """Part of the torque of a linkage that one of its two joints may take alone: a waist that bends under a load would
    leave nothing against falling sideways."""
    stop_torque: NonNegative = 60.0
    """Torque that the mechanical stop of a joint may bear that rests on it [N·m]: what a waist that bows with a load in
    its hands lacks."""
