"""Baselines: a quadratic program that balances on both feet, and third-party controllers."""

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from iowbc.recipe.beside import ModuleFile
from iowbc.recipe.section import COSMETIC, Problems, Section

PositiveShare = Annotated[float, Field(gt=0, le=1)]


class Tracking(Section):
    """Task: a desired acceleration of stiffness · error − damping · velocity, with the cost ½·weight·(deviation)²."""

    weight: PositiveFloat
    """Weight of the squared deviation from the desired acceleration [s⁴/m² or s⁴/rad²]."""
    stiffness: NonNegativeFloat
    """Proportional gain: acceleration per unit of error [1/s²]."""
    damping: NonNegativeFloat
    """Derivative gain: deceleration per unit of velocity [1/s]."""


class Estimation(Section):
    """Noise parameters of the Kalman filter for tilt and joints."""

    position_noise: NonNegativeFloat = 0.01
    """Standard deviation of measured joint positions [rad]."""
    velocity_noise: NonNegativeFloat = 0.5
    """Standard deviation of measured joint velocities [rad/s]."""
    gravity_noise: NonNegativeFloat = 0.02
    """Standard deviation of the measured direction of gravity [rad]."""
    gyro_noise: NonNegativeFloat = 0.1
    """Standard deviation of the measured angular velocity of the base [rad/s]."""
    model_error: PositiveFloat = 3.0
    """Standard deviation of the error of the planned acceleration in a control period [rad/s²]."""
    load_drift: PositiveFloat = 5.0
    """Random walk of the steady error of the planned acceleration, such as that due to a load [rad/s² per √s]. The
    filter accounts for this error, the program does not."""


class ModelBased(Section):
    """The model-based baseline: a quadratic program that stands, crouches and leans on both feet; it does not walk.

    Its model is the nominal robot without a load. It sees the same observation as the student and acts through the same
    joint controllers.
    """

    com: Tracking = Tracking(weight=100.0, stiffness=40.0, damping=10.0)
    """Horizontal centre of mass, over the midpoint of the soles. Stiffness · height / gravity is 2.9: about three times
    the stiffness that compensates gravity. Above 60, tilt and joint noise makes the robot sway from foot to foot."""
    height: Tracking = Tracking(weight=100.0, stiffness=80.0, damping=14.0)
    """Height of the pelvis. With a lower weight than the centre of mass, the robot sinks to hold the torso up."""
    torso: Tracking = Tracking(weight=5.0, stiffness=250.0, damping=29.0)
    """Orientation of the torso: commanded pitch, zero roll, mean yaw of the soles. The stiffness is high because the
    load in the hands, which the model lacks, bends the torso."""
    posture: Tracking = Tracking(weight=0.4, stiffness=44.0, damping=12.0)
    """Support joints, towards the same reference θ_S_ref that the learnt policies correct."""
    torque_weight: PositiveFloat = 1e-3
    """Weight of squared joint torques [1/(N·m)²]; it resolves the load distribution between the feet."""
    contact_damping: NonNegativeFloat = 24.0
    """Deceleration of the soles per unit of their velocity [1/s]: they come to rest within a few periods."""
    lead: NonNegativeFloat = 0.02
    """Time by which the state is extrapolated [s]: the mean total latency of sensors and actions in simulation."""
    estimation: Estimation = Estimation()
    friction: PositiveFloat = 0.5
    """Friction coefficient of the soles in the program; the smallest that the simulation draws."""
    sole_fraction: PositiveShare = 0.9
    """Fraction of the sole's rectangle within which each centre of pressure stays."""
    smallest_load: NonNegativeFloat = 20.0
    """Smallest normal force on each foot [N]."""
    limit_margin: NonNegativeFloat = 0.02
    """Distance kept from joint limits [rad]."""
    limit_time: PositiveFloat = 0.1
    """Time within which no joint may reach its limit at the planned acceleration [s]."""
    effort_fraction: PositiveShare = 0.95
    """Fraction of the torque limits that the program may use."""
    linkage_share: PositiveShare = 0.9
    """Fraction of a linkage's torque available to either of its two joints alone. Otherwise a waist that pitches under
    a load would have no roll torque left against falling sideways."""
    stop_torque: NonNegativeFloat = 60.0
    """Torque that a joint's mechanical stop may bear when the joint rests on it [N·m]. A waist that pitches forward
    with a load needs it in addition to its motors."""


class PublicController(Section):
    """A public controller. The recipe holds its digest, not its content."""

    adapter: Literal["holosoma", "deploy", "own"]
    """Source of its observation, action, gains and frequency: `holosoma`: the walking policies of that project;
    `deploy`: a folder with a network and the `deploy.yaml` of Isaac Lab exports; `own`: a custom `module`."""
    module: ModuleFile | None = None
    """Python file with a function `adapter(policy)`, which takes the controller's path and returns an
    `iowbc.adapters.adapter.Adapter`; for the adapter `own` alone."""
    policy: str = Field(min_length=1, json_schema_extra=COSMETIC)
    """Its file or folder: a path relative to the working folder, or PACKAGE:PATH for a file of an installed package."""
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    """SHA-256 of the file; for a folder, SHA-256 of its sorted lines `DIGEST  NAME`, as `sha256sum` prints them."""
    arms: Literal["measured", "default", "free", "own"] = "measured"
    """Control and observation of the arms. `measured`, `default`: this project's inverse kinematics holds the grasp;
    the controller observes the arms as measured, or at rest in its default posture (observed grasps may disturb a
    policy that was trained to move its arms; choose on development trials). `own`: the controller moves the arms, with
    its own gains. `free`: it moves them in trials without an object only."""
    heading_gain: float = Field(default=0.5, ge=0.0)
    """Yaw rate commanded per radian of heading error [1/s]. These controllers track rates and therefore drift; learnt
    policies of this project observe the heading error. Velocity tasks of Isaac Lab train with 0.5."""

    @property
    def moves_arms(self) -> bool:
        """True where the arms follow the controller's outputs in some trials."""
        return self.arms in ("free", "own")

    def problems(self) -> Problems:
        if (self.adapter == "own") != (self.module is not None):
            yield "", "module: belongs to the adapter 'own', which needs it"
