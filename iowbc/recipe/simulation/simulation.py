"""Simulation settings: physics, scenes, partner, randomization, sensing."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from iowbc.recipe.section import LATER, Problems, Section
from iowbc.recipe.simulation.partner import PartnerSettings
from iowbc.recipe.simulation.randomization import Impulses, Pushes, Randomization
from iowbc.recipe.simulation.scene import Scenes


class SensorNoise(Section):
    """Standard deviations of white measurement noise; biases and latencies are in `randomization`."""

    enabled: bool = True
    """Enable white noise; bias and latency are independent of it."""
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


class Physics(Section):
    """Integration by MuJoCo."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"divergences_kept": 8}

    timestep: float = Field(default=0.005, gt=0.0, le=0.02)
    """Physics step [s]; the control period must be a multiple of it."""
    pd: Literal["implicit", "explicit"] = "implicit"
    """Damping of the joint controllers: integrated implicitly (stable at any gain) or, as on the robot, computed
    explicitly from the measured state at the physics rate, which requires a short step (2 ms here)."""
    torque_corner: float = Field(default=0.6, ge=0.0, lt=1.0)
    """Fraction of the no-load speed up to which a motor gives its full torque; beyond it, the torque falls linearly to
    zero. An assumption, not a measured curve."""
    cone: Literal["pyramidal", "elliptic"] = "pyramidal"
    """Friction cone: an inscribed pyramid with corners on the world's axes, which allows down to 0.71 of the friction
    between them, or the exact elliptic cone at 10 % more computing time."""
    foot_time_constant: float = Field(default=0.02, gt=0.0, json_schema_extra=LATER)
    """Time constant of the contact between feet and ground [s], at least two physics steps. It is also that of a
    sliding foot's deceleration: with 10 ms and the elliptic cone feet slide half as far (docs/engines.md)."""
    solver: Literal["newton", "cg"] = "newton"
    """Constraint solver."""
    iterations: int = Field(default=10, ge=1, le=10_000)
    """Largest number of solver iterations. Ten give the trajectories of a hundred to machine precision at no cost,
    because the solver stops at convergence; with five, joints are off by 0.1 rad after half a second."""
    line_search_iterations: int = Field(default=20, ge=1, le=10_000)
    """Largest number of line search iterations; the line search also stops at convergence."""
    body_contact: Literal["nothing", "object", "everything"] = "object"
    """Bodies that collide with links other than soles and palms. With `nothing`, a held box sinks 4 cm into thighs and
    torso; self-collisions and falls on hands and knees need `everything`. docs/simulation.md lists the costs."""
    leg_contact: bool = True
    """Enable collisions between the legs, feet included; otherwise feet pass through each other and steps may cross."""
    contact_force: float = Field(default=1.0, gt=0.0)
    """Smallest contact force of a foot on the ground, or of a palm on an object, that counts as contact [N]."""
    fastest: float = Field(default=200.0, gt=0.0)
    """Speed above which a simulation counts as diverged [m/s, rad/s]; the fastest joint reaches 37 rad/s."""

    def problems(self) -> Problems:
        if self.foot_time_constant < 2.0 * self.timestep:
            text = f"{self.foot_time_constant:g} s is less than two physics steps of {self.timestep:g} s"
            yield "", f"foot_time_constant: {text}: raise it or shorten `timestep`"


class SimulationSettings(Section):
    """Simulation settings: physics, scenes, partner, randomization, sensing."""

    physics: Physics = Physics()
    scenes: Scenes = Scenes()
    partner: PartnerSettings = PartnerSettings()
    randomization: Randomization = Randomization()
    impulses: Impulses = Impulses()
    pushes: Pushes = Pushes()
    sensing: SensorNoise = SensorNoise()
