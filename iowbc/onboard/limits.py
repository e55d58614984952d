"""Numbers that decide when a robot may move and when it is damped."""

from pydantic import Field

from iowbc.recipe.section import Section


class SafetyLimits(Section):
    """Limits of checks and watchdogs."""

    state_age: float = Field(default=0.015, gt=0.0)
    """Age of the newest state at which it is stale [s]: seven lost messages at 500 Hz, and with a period of the loop
    damping begins within 20 ms of the last one."""
    command_age: float = Field(default=0.5, gt=0.0)
    """Age of the newest command at which it is stale [s]; the robot covers 0.3 m in it at full speed."""
    object_age: float = Field(default=0.1, gt=0.0)
    """Age of the newest object pose at which it is stale [s]: five control periods."""
    overrun: float = Field(default=0.01, gt=0.0)
    """Longest time between two turns of the loop [s]: five periods, half a control period."""
    tilt: float = Field(default=1.0, gt=0.0)
    """Largest angle between pelvis and vertical [rad]; deep bows lean by 0.6, and beyond 1 it falls."""
    position_margin: float = Field(default=0.1, ge=0.0)
    """Largest measured distance of a joint beyond its limits [rad]: encoder bias and elastic stops."""
    speed: float = Field(default=1.0, gt=0.0)
    """Highest joint speed as a multiple of the motor's no-load speed."""
    torque: float = Field(default=1.2, gt=0.0)
    """Highest estimated torque as a multiple of the motor's limit: saturation is allowed, the estimate has errors."""
    battery: float = Field(default=20.0, ge=0.0, le=100.0)
    """Least charge to begin with, below which a moving robot warns [%]."""
    battery_empty: float = Field(default=10.0, ge=0.0, le=100.0)
    """Least charge to move with [%]; an assumption, for the charge at which the robot turns off is not public."""
    temperature: float = Field(default=80.0, gt=0.0)
    """Highest motor temperature to begin with, above which a moving robot warns [°C]."""
    temperature_hot: float = Field(default=100.0, gt=0.0)
    """Highest motor temperature to move with [°C]; an assumption, for the drives' own limit is not public."""
    standing_tilt: float = Field(default=0.35, gt=0.0)
    """Largest angle between pelvis and vertical at which Stand and Run begin [rad]."""
    standing_speed: float = Field(default=3.0, gt=0.0)
    """Highest joint speed at which Stand begins [rad/s]; noise alone reaches 1.7 in training."""
    standing_error: float = Field(default=0.3, gt=0.0)
    """Largest distance of a joint from the standing posture at which Run begins [rad]; arms sag under a load."""
    ramp: float = Field(default=3.0, gt=0.0)
    """Time over which Stand raises the gains and moves to the standing posture [s]."""
    damping: float = Field(default=1.0, gt=0.0)
    """Velocity gains while damping, as a multiple of the contract's."""


LIMITS = SafetyLimits()
