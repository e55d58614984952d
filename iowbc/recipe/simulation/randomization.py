"""Quantities that are drawn anew for each episode, and the disturbances within one; ranges of the paper's Table I."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from iowbc.recipe.section import LATER, Interval, Section


class Distribution(Interval):
    """x ~ U(low, high), or its logarithm uniform; or else the nominal value."""

    nominal: float
    """Value where the entry is disabled or not drawn."""
    shape: Literal["uniform", "log-uniform"] = "uniform"
    """Uniform between the ends, or uniform in the logarithm."""
    probability: float = Field(default=1.0, ge=0.0, le=1.0)
    """Chance that a value is drawn; otherwise it is the nominal one."""
    enabled: bool = True
    """Off always gives the nominal value."""

    def problems(self) -> Iterator[tuple[str, str]]:
        yield from super().problems()
        if self.shape == "log-uniform" and self.low <= 0.0:
            yield "", f"a log-uniform range must be positive, got low {self.low}"


LATENCIES = ("action_latency", "sensor_latency", "object_latency")
SIGNED = ("object_com_offset", "encoder_bias", "imu_tilt", "heading_drift", "gyro_bias", "start_yaw")
"""Quantities that may be negative."""
POSITIVE = ("link_mass_scale", "link_inertia_scale")
"""Quantities that must not be zero."""


class Randomization(Section):
    """Quantities drawn once an episode."""

    enabled: bool = True
    """Off gives every entry its nominal value."""
    object_mass_scale: Distribution = Distribution(low=0.07, high=1.5, nominal=1.0)
    """Object mass as a part of the nominal one: from 0.5 kg in the hands and a crate of 5 kg, the lightest loads of the
    trials, to 150 %. Table I has 50 to 150 %."""
    light_share: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Part of the episodes whose object is light: its mass is log-uniform between the lower end of `object_mass_scale`
    and `light_end`. A range that begins at 0.05 kg and is drawn evenly has 4 % of its masses below 0.5 kg."""
    light_end: float = Field(default=0.1, gt=0.0, json_schema_extra=LATER)
    """Heaviest light object as a part of the nominal mass: 0.7 kg in the hands, a crate of 6.5 kg."""
    inertia_scale: Distribution = Distribution(low=0.8, high=1.2, nominal=1.0)
    """Object inertia as a part of that of a uniform body of its mass."""
    object_com_offset: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Offset of the object's centre of mass from its centre, per axis [m]."""
    ground_friction: Distribution = Distribution(low=0.5, high=1.2, nominal=0.8)
    """Friction between feet and ground (Table I)."""
    object_ground_friction: Distribution = Distribution(low=0.02, high=0.15, nominal=0.06)
    """Rolling resistance μ of the crate on its wheels (Table I)."""
    surface_friction: Distribution = Distribution(low=1.0, high=1.5, nominal=1.2)
    """Friction between palms and object (Table I)."""
    link_mass_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Mass of each link as a part of its nominal one; the inertia follows."""
    link_inertia_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Further factor on the inertia of each link."""
    joint_friction: Distribution = Distribution(low=0.0, high=0.3, nominal=0.0, probability=0.3)
    """Dry friction of each joint [N·m]; in some episodes only, for its 29 constraint rows slow the physics by 15 %."""
    motor_damping: Distribution = Distribution(low=0.0, high=0.5, nominal=0.0)
    """Viscous friction of each joint beyond the controller's own damping [N·m·s/rad]."""
    kp_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Position gain of each joint as a part of its nominal one."""
    kd_scale: Distribution = Distribution(low=0.9, high=1.1, nominal=1.0)
    """Velocity gain of each joint as a part of its nominal one."""
    motor_strength: Distribution = Distribution(low=0.85, high=1.0, nominal=1.0)
    """Torque limit of each joint as a part of its nominal one; batteries run down and motors warm up."""
    linkage_effort: Distribution = Distribution(low=35.0, high=50.0, nominal=50.0)
    """Torque that the two joints of a linkage (ankles, waist roll and pitch) have together at full motor strength
    [N·m]; public sources give 35 and 50. The mean strength of the two motors scales it."""
    encoder_bias: Distribution = Distribution(low=-0.015, high=0.015, nominal=0.0)
    """Constant error of each joint position sensor [rad]; the joint controllers take it for true, too."""
    imu_tilt: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Constant roll and pitch of the inertial unit against the base [rad]; two degrees of mounting and calibration."""
    heading_drift: Distribution = Distribution(low=-0.002, high=0.002, nominal=0.0)
    """Drift of the heading that the inertial unit integrates [rad/s]: it knows its gyro's bias from standing still, and
    errs by some degrees a minute. A skill layer with a view of the world would correct it."""
    gyro_bias: Distribution = Distribution(low=-0.02, high=0.02, nominal=0.0)
    """Constant error of the measured angular velocity, per axis [rad/s]; a warm low-cost gyroscope drifts by this."""
    start_yaw: Distribution = Distribution(low=-3.141592653589793, high=3.141592653589793, nominal=0.0)
    """Heading in which an episode begins, against the world's x axis [rad]; nothing may depend on it."""
    action_latency: Distribution = Distribution(low=0.0, high=1.0, nominal=0.0)
    """Delay of the joint targets [control periods], to the nearest physics step."""
    sensor_latency: Distribution = Distribution(low=0.0, high=1.0, nominal=0.0)
    """Delay of joint and inertial measurements [control periods]."""
    slow_share: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Part of the episodes in which action and sensor latency are both in the upper third of their ranges. Drawn
    independently, one in nine has both, and robots that stand either of them fall with both."""
    object_latency: Distribution = Distribution(low=0.0, high=2.0, nominal=0.0)
    """Delay of the measured pose and rates of the object [control periods]."""
    longest_latency: int = Field(default=4, ge=1, le=100)
    """Length of the delay lines [control periods]; no latency may pass it."""

    def problems(self) -> Iterator[tuple[str, str]]:
        for name, values in self:
            for end in ("low", "high", "nominal") if isinstance(values, Distribution) else ():
                value = getattr(values, end)
                if name in LATENCIES and not 0 <= value <= self.longest_latency:
                    yield f"{name}.{end}", f"should be 0 to longest_latency, {self.longest_latency} periods"
                elif name not in SIGNED and value < 0:
                    yield f"{name}.{end}", "should be 0 or more"
                elif name in POSITIVE and value == 0:
                    yield f"{name}.{end}", "should be positive: no link is without mass"


class Impulses(Section):
    """Random impulses on the object's centre of mass (paper III-D: I_rand)."""

    enabled: bool = True
    """Off leaves the object alone."""
    interval: Distribution = Distribution(low=1.5, high=4.0, nominal=3.0)
    """Time from one impulse to the next [s]."""
    magnitude: Distribution = Distribution(low=1.0, high=8.0, nominal=4.0)
    """Size [N·s]; 8 N·s stop a 7 kg box that moves at 1.1 m/s."""
    duration: float = Field(default=0.1, gt=0.0)
    """Time over which an impulse acts, as a constant force [s]."""


class Pushes(Section):
    """Random pushes on the robot's base."""

    enabled: bool = True
    """Off leaves the base alone."""
    interval: Distribution = Distribution(low=2.0, high=5.0, nominal=4.0)
    """Time from one push to the next [s]."""
    speed: Distribution = Distribution(low=0.0, high=0.5, nominal=0.3)
    """Change of the robot's velocity that a push would give it in the air, in a random horizontal direction [m/s]."""
    duration: float = Field(default=0.1, gt=0.0)
    """Time over which a push acts, as a constant force [s]."""
