"""The world: physics, scenes, partner, randomisation, sensing."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.partner import Partner
from iowbc.recipe.randomization import Impulses, Pushes, Randomization
from iowbc.recipe.scene import Scenes
from iowbc.recipe.section import Section
from iowbc.recipe.sensing import Sensing


class Physics(Section):
    """How MuJoCo integrates."""

    timestep: float = Field(default=0.005, gt=0.0, le=0.02)
    """Physics step [s]; a whole number of them makes a control period."""
    pd: Literal["implicit", "explicit"] = "implicit"
    """Whether the damping of the joint controllers is integrated implicitly (stable at any gain) or, as on the robot,
    computed explicitly from the measured state at the physics rate."""
    cone: Literal["pyramidal", "elliptic"] = "elliptic"
    """Friction cone: a pyramid, or the cone itself, which is as fast here and slides alike in all directions."""
    solver: Literal["newton", "cg"] = "newton"
    """Constraint solver."""
    iterations: int = Field(default=5, ge=1)
    """Solver iterations at most."""
    line_search_iterations: int = Field(default=8, ge=1)
    """Line search iterations at most."""
    body_contact: bool = False
    """Whether links touch one another, the ground and the object; without, only soles and palms touch anything."""
    contact_force: float = Field(default=1.0, gt=0.0)
    """Vertical force above which a foot counts as being on the ground [N]."""
    fastest: float = Field(default=200.0, gt=0.0)
    """Speed above which a simulation counts as diverged [m/s, rad/s]; the fastest joint reaches 37 rad/s."""
    divergences_kept: int = Field(default=8, ge=0)
    """How many diverged simulations are kept for replay."""


class Simulation(Section):
    """The world: physics, scenes, partner, randomisation, sensing."""

    physics: Physics = Physics()
    """How MuJoCo integrates."""
    scenes: Scenes = Scenes()
    """The worlds by name."""
    partner: Partner = Partner()
    """The second carrier."""
    randomization: Randomization = Randomization()
    """What is drawn anew for each episode."""
    impulses: Impulses = Impulses()
    """Impulses on the object's centre of mass."""
    pushes: Pushes = Pushes()
    """Pushes on the base."""
    sensing: Sensing = Sensing()
    """What the sensors add to the truth."""
