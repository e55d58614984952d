"""What the robot's sensors add to the truth."""

from pydantic import Field

from iowbc.recipe.section import Section


class Sensing(Section):
    """White noise per measurement, standard deviations; biases and latencies are in `randomization`."""

    enabled: bool = True
    """Off measures the truth, but for bias and latency."""
    joint_position: float = Field(default=0.01, ge=0.0)
    """Joint positions [rad]."""
    joint_velocity: float = Field(default=0.5, ge=0.0)
    """Joint velocities [rad/s]."""
    angular_velocity: float = Field(default=0.1, ge=0.0)
    """Angular velocity of the base [rad/s]."""
    gravity: float = Field(default=0.02, ge=0.0)
    """Direction of gravity in the base frame, per axis [1]."""
    heading: float = Field(default=0.005, ge=0.0)
    """Heading of the base [rad]; its slow drift is `randomization.heading_drift`."""
    object_position: float = Field(default=0.005, ge=0.0)
    """Object position in the base frame, per axis [m]."""
    object_orientation: float = Field(default=0.02, ge=0.0)
    """Object orientation in the base frame, as a rotation vector, per axis [rad]."""
    object_velocity: float = Field(default=0.05, ge=0.0)
    """Velocity of the object relative to the base, per axis [m/s]."""
    object_angular_velocity: float = Field(default=0.1, ge=0.0)
    """Angular velocity of the object relative to the base, per axis [rad/s]."""
