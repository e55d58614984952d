"""Domain randomization: quantities drawn per episode, and disturbances within one; ranges of the paper's Table I."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from iowbc.recipe.section import LATER, Interval, Problems, Section


class Distribution(Interval):
    """Uniform or log-uniform distribution over [low, high], mixed with a nominal value."""

    nominal: float
    """Value if the entry is disabled or not drawn."""
    shape: Literal["uniform", "log-uniform"] = "uniform"
    """Uniform in the value, or in its logarithm."""
    probability: float = Field(default=1.0, ge=0.0, le=1.0)
    """Probability that a value is drawn; otherwise it is the nominal one."""
    enabled: bool = True
    """Enable the randomization; otherwise always the nominal value."""

    def problems(self) -> Problems:
        yield from super().problems()
        if self.shape == "log-uniform" and self.low <= 0.0:
            yield "", f"a log-uniform range must be positive, got low {self.low}"


def _not_negative(values: Distribution) -> Distribution:
    if min(values.low, values.nominal) < 0.0:
        raise ValueError("should be 0 or more")
    return values


NotNegative = Annotated[Distribution, AfterValidator(_not_negative)]
"""A distribution without negative values."""
LATENCIES = ("action_latency", "sensor_latency", "object_latency")
SIGNED = ("object_com_offset", "encoder_bias", "imu_tilt", "heading_drift", "gyro_bias", "start_yaw")
"""Quantities that may be negative."""
POSITIVE = ("link_mass_scale", "link_inertia_scale")
"""Quantities that must not be zero."""


class Randomization(Section):
    """Domain randomization: quantities drawn at the start of each episode."""

    enabled: bool = True
    """Enable the randomization; otherwise every entry has its nominal value. The curriculum scales an object's mass in
    any case."""
    object_mass_scale: Distribution = Distribution(low=0.07, high=1.5, nominal=1.0)
    """Object mass relative to the nominal one: from a 0.5 kg box and a 5 kg crate, the lightest loads of the trials, to
    150 %. Table I has 50 to 150 %."""
    light_share: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Fraction of the episodes whose object is made light, besides those that draw a light one: its mass is log-uniform
    between the lower end of `object_mass_scale` and `light_end`. A uniform range from 0.05 kg has only 4 % of its
    masses below 0.5 kg."""
    light_end: float = Field(default=0.1, gt=0.0, json_schema_extra=LATER)
    """Largest mass of a light object relative to the nominal one: 0.7 kg in the hands, a crate of 6.5 kg."""
    inertia_scale: Distribution = Distribution(low=0.8, high=1.2, nominal=1.0)
    """Object inertia relative to that of a uniform body of its mass."""
    object_com_offset: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Offset of the object's centre of mass from its centre, per axis [m]."""
    ground_friction: Distribution = Distribution(low=0.5, high=1.2, nominal=0.8)
    """Friction between feet and ground (Table I)."""
    object_ground_friction: Distribution = Distribution(low=0.02, high=0.15, nominal=0.06)
    """Rolling resistance μ of the crate on its wheels (Table I)."""
    surface_friction: Distribution = Distribution(low=1.0, high=1.5, nominal=1.2)
    """Friction between palms and object (Table I)."""
    link_mass_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Mass of each link relative to its nominal one; the inertia scales with it."""
    link_inertia_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Further factor on the inertia of each link."""
    joint_friction: Distribution = Distribution(low=0.0, high=0.3, nominal=0.0, probability=0.3)
    """Dry friction of each joint [N·m]; only in some episodes: its 29 constraint rows slow the physics by 15 %."""
    motor_damping: Distribution = Distribution(low=0.0, high=0.5, nominal=0.0)
    """Viscous friction of each joint beyond the controller's own damping [N·m·s/rad]."""
    kp_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Position gain of each joint relative to its nominal one."""
    kd_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Velocity gain of each joint relative to its nominal one."""
    motor_strength: Distribution = Distribution(low=0.85, high=1.0, nominal=1.0)
    """Torque limit of each joint relative to its nominal one; batteries run down and motors warm up."""
    linkage_effort: Distribution = Distribution(low=35.0, high=50.0, nominal=50.0)
    """Joint torque limit of the two joints of a linkage (ankles, waist roll and pitch) at full motor strength [N·m];
    public sources give 35 and 50. It is scaled by the mean strength of the two motors."""
    encoder_bias: Distribution = Distribution(low=-0.015, high=0.015, nominal=0.0)
    """Constant error of each joint position sensor [rad]; it affects the joint controllers, too."""
    imu_tilt: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Constant roll and pitch of the IMU relative to the base [rad]: two degrees from mounting and calibration."""
    heading_drift: Distribution = Distribution(low=-0.002, high=0.002, nominal=0.0)
    """Drift of the heading that the IMU integrates [rad/s]: with its gyro bias calibrated at rest, it drifts by some
    degrees per minute. A skill layer with exteroception would correct it."""
    gyro_bias: Distribution = Distribution(low=-0.02, high=0.02, nominal=0.0)
    """Constant error of the measured angular velocity, per axis [rad/s]; a warm low-cost gyroscope drifts by this."""
    start_yaw: Distribution = Distribution(low=-3.141592653589793, high=3.141592653589793, nominal=0.0)
    """Initial heading relative to the world's x axis [rad]; behaviour must not depend on it."""
    action_latency: Distribution = Distribution(low=0.0, high=1.0, nominal=0.0)
    """Delay of the joint targets [control periods], to the nearest physics step."""
    sensor_latency: Distribution = Distribution(low=0.0, high=1.0, nominal=0.0)
    """Delay of joint and inertial measurements [control periods]."""
    slow_share: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Fraction of the episodes in which action and sensor latency are both drawn from the upper third of their ranges,
    besides one in nine of the others, by chance; robots that tolerate either of them fall with both."""
    object_latency: Distribution = Distribution(low=0.0, high=2.0, nominal=0.0)
    """Delay of the measured pose and rates of the object [control periods]."""
    longest_latency: int = Field(default=4, ge=1, le=100)
    """Length of the delay buffers [control periods]; no latency may exceed it."""

    def problems(self) -> Problems:
        for name, values in self:
            for end in ("low", "high", "nominal") if isinstance(values, Distribution) else ():
                value = getattr(values, end)
                if name in LATENCIES and not 0 <= value <= self.longest_latency:
                    yield f"{name}.{end}", f"should be 0 to longest_latency, {self.longest_latency} periods"
                elif name not in SIGNED and value < 0:
                    yield f"{name}.{end}", "should be 0 or more"
                elif name in POSITIVE and value == 0:
                    yield f"{name}.{end}", "should be positive: no link is without mass"
        if self.light_share and not self.light_end >= self.object_mass_scale.low > 0.0:
            yield "light_share", "draws from object_mass_scale.low, which should be positive, to light_end, above it"


class Impulses(Section):
    """Random impulses on the object's centre of mass (paper III-D: I_rand)."""

    enabled: bool = True
    """Enable impulses on the object."""
    interval: NotNegative = Distribution(low=1.5, high=4.0, nominal=3.0)
    """Time from one impulse to the next [s]."""
    magnitude: NotNegative = Distribution(low=1.0, high=8.0, nominal=4.0)
    """Magnitude [N·s]; 8 N·s stop a 7 kg box that moves at 1.1 m/s."""
    duration: float = Field(default=0.1, gt=0.0)
    """Duration of an impulse, a constant force [s]."""


class Pushes(Section):
    """Random pushes on the robot's base."""

    enabled: bool = True
    """Enable pushes on the base."""
    interval: NotNegative = Distribution(low=2.0, high=5.0, nominal=4.0)
    """Time from one push to the next [s]."""
    speed: NotNegative = Distribution(low=0.0, high=0.5, nominal=0.3)
    """Velocity change that a push would give the free robot, in a random horizontal direction [m/s]."""
    duration: float = Field(default=0.1, gt=0.0)
    """Duration of a push, a constant force [s]."""
