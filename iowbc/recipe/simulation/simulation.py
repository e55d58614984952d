"""The world: physics, scenes, partner, randomisation, sensing."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import COSMETIC, Section
from iowbc.recipe.simulation.partner import PartnerSettings
from iowbc.recipe.simulation.randomization import Impulses, Pushes, Randomization
from iowbc.recipe.simulation.scene import Scenes


class SensorNoise(Section):
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


class Physics(Section):
    """Integration by MuJoCo."""

    timestep: float = Field(default=0.005, gt=0.0, le=0.02)
    """Physics step [s]; a whole number of them makes a control period."""
    pd: Literal["implicit", "explicit"] = "implicit"
    """Damping of the joint controllers: integrated implicitly (stable at any gain) or, as on the robot,
    computed explicitly from the measured state at the physics rate; then the step must be short enough, 2 ms here."""
    torque_corner: float = Field(default=0.6, ge=0.0, lt=1.0)
    """Part of the no-load speed up to which a motor gives its full torque; beyond, it falls to nothing in a line.
    An assumption, not a measured curve."""
    cone: Literal["pyramidal", "elliptic"] = "pyramidal"
    """Friction cone: the pyramid inscribed in it, or the cone itself, which costs a tenth more."""
    solver: Literal["newton", "cg"] = "newton"
    """Constraint solver."""
    iterations: int = Field(default=10, ge=1, le=10_000)
    """Solver iterations at most. Ten give the trajectories of a hundred to machine precision at no cost, for the solver
    stops when it has converged; at five, joints are off by 0.1 rad after half a second."""
    line_search_iterations: int = Field(default=20, ge=1, le=10_000)
    """Line search iterations at most; as above."""
    body_contact: Literal["nothing", "object", "everything"] = "object"
    """Bodies that links other than soles and palms touch. Where they touch nothing, a held box sinks 4 cm into thighs
    and torso; self-collisions and falls on hands and knees need everything. docs/simulation.md has the costs."""
    leg_contact: bool = True
    """Lets the legs, feet included, touch each other; off, feet pass through each other and steps may cross."""
    contact_force: float = Field(default=1.0, gt=0.0)
    """Force above which a foot counts as being on the ground, and a palm as touching an object [N]."""
    fastest: float = Field(default=200.0, gt=0.0)
    """Speed above which a simulation counts as diverged [m/s, rad/s]; the fastest joint reaches 37 rad/s."""
    divergences_kept: int = Field(default=8, ge=0, le=1000, json_schema_extra=COSMETIC)
    """Number of diverged simulations that are kept for replay."""


class SimulationSettings(Section):
    """The world: physics, scenes, partner, randomisation, sensing."""

    physics: Physics = Physics()
    """Integration by MuJoCo."""
    scenes: Scenes = Scenes()
    """The worlds by name."""
    partner: PartnerSettings = PartnerSettings()
    """The second carrier."""
    randomization: Randomization = Randomization()
    """Quantities that are drawn anew for each episode."""
    impulses: Impulses = Impulses()
    """Impulses on the object's centre of mass."""
    pushes: Pushes = Pushes()
    """Pushes on the base."""
    sensing: SensorNoise = SensorNoise()
    """Errors that the sensors add to the truth."""
