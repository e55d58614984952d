"""The simulated partner who carries or pushes at the object's far handle."""

from typing import Literal, get_args

from pydantic import Field

from iowbc.recipe.section import LATER, Problems, Section
from iowbc.recipe.simulation.randomization import Distribution, NotNegative

LONGEST_DELAY = 10.0
"""Longest delay that a recipe may draw [s]."""
Behaviour = Literal["path", "follower", "leader", "stopping", "tugging", "lagging"]
BEHAVIOURS: tuple[Behaviour, ...] = get_args(Behaviour)
"""All behaviours; `partner_behaviour` is an index into this list. The last two are for evaluation only."""


class Behaviours(Section):
    """Relative frequencies of the partner's behaviours, drawn per episode; only the proportions matter."""

    path: float = Field(default=1.0, ge=0.0)
    """Follows the commanded motion and height from where the episode began, wherever the robot is."""
    follower: float = Field(default=0.0, ge=0.0)
    """Carries its share and moves with the handle: no horizontal force at a constant velocity."""
    leader: float = Field(default=0.0, ge=0.0)
    """Deviates from the command with its own pace, heading, sideways drift and height."""
    stopping: float = Field(default=0.0, ge=0.0)
    """Follows the commanded motion, stops or reverses suddenly, and resumes."""

    def problems(self) -> Problems:
        if sum(share for _, share in self) <= 0.0:
            yield "", "every behaviour has the share 0: give at least one of them a positive share"


class Leader(Section):
    """Deviation of a leading partner from the commanded motion."""

    pace: Distribution = Distribution(low=0.0, high=1.5, nominal=1.0)
    """Speed relative to the commanded one: from standing to 50 % faster."""
    turning: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Yaw rate added to the commanded one while walking [rad/s]: up to half a radian of drift in a trial."""
    sideways: Distribution = Distribution(low=-0.1, high=0.1, nominal=0.0)
    """Velocity to the left, added while walking [m/s]; up to half of the largest commanded one."""
    rise: Distribution = Distribution(low=0.0, high=0.06, nominal=0.0)
    """Amplitude of a sinusoidal height profile [m]; hands rise and sink by this in a natural gait with a load."""
    rise_period: float = Field(default=4.0, gt=0.0)
    """Period of that profile [s]; three or four steps."""


class Stopping(Section):
    """A sudden stop of the partner."""

    begin: NotNegative = Distribution(low=2.0, high=10.0, nominal=5.0)
    """Time of the stop in the episode [s]."""
    duration: NotNegative = Distribution(low=1.0, high=4.0, nominal=2.5)
    """Time until the partner resumes [s]."""
    reverse: Distribution = Distribution(low=0.2, high=0.6, nominal=0.0, probability=0.5)
    """Backward speed during the stop relative to the commanded one; 0: stand still."""
    catching_up: float = Field(default=1.0, gt=0.0)
    """Time in which the partner returns to the handle after the stop [s]; otherwise it would hold back for ever."""


OWN_DRAWS: dict[str, type[Section]] = {"leader": Leader, "stopping": Stopping}
"""Sections of `PartnerSettings` with quantities drawn per episode."""


class Tugging(Section):
    """Periodic pulls of a partner that otherwise follows the path; evaluation only."""

    force: float = Field(default=40.0, ge=0.0)
    """Horizontal force of a pull [N]; a firm pull of one arm, half of `strongest`."""
    interval: float = Field(default=2.0, gt=0.0)
    """Time from one pull to the next [s]."""
    duration: float = Field(default=0.5, gt=0.0)
    """Duration of a pull [s]; longer than a step, so that it cannot be waited out."""


class Lagging(Section):
    """A partner that reacts late and hardly damps; evaluation only."""

    delay: float = Field(default=0.6, ge=0.0, le=LONGEST_DELAY)
    """Delay behind the commanded motion [s]: twice the largest that training draws."""
    damping: float = Field(default=0.25, ge=0.0)
    """Factor on the drawn damping."""


class PartnerSettings(Section):
    """Compliant partner: spring, damper and preload at the far handle. Its behaviour determines its motion."""

    enabled: bool = True
    """Enable the partner in episodes that draw its share; trials with a given share have a partner all the same."""
    share: Distribution = Distribution(low=0.0, high=0.6, nominal=0.0, probability=0.7)
    """Fraction of a held object's weight that the partner bears; 0: no partner."""
    push_share: Distribution = Distribution(low=-0.3, high=0.6, nominal=0.0, probability=0.7)
    """Fraction of the rolling resistance that the partner overcomes in a push; negative: it resists, 0: no partner."""
    share_drift: NotNegative = Distribution(low=0.0, high=0.1, nominal=0.0)
    """Standard deviation of the share's variation within an episode; nobody carries evenly."""
    drift_time: float = Field(default=3.0, gt=0.0)
    """Correlation time of that variation [s]; a few steps."""
    stiffness: NotNegative = Distribution(low=100.0, high=600.0, nominal=300.0, shape="log-uniform")
    """Stiffness at the handle, horizontal and vertical [N/m]; that of human arms."""
    damping: NotNegative = Distribution(low=20.0, high=100.0, nominal=50.0, shape="log-uniform")
    """Damping at the handle [N·s/m]."""
    delay: NotNegative = Distribution(low=0.05, high=0.3, nominal=0.15)
    """Delay of the partner behind the commanded motion [s], up to 10; human reaction times."""
    behaviours: Behaviours = Field(default=Behaviours(), json_schema_extra=LATER)

    leader: Leader = Field(default=Leader(), json_schema_extra=LATER)
    stopping: Stopping = Field(default=Stopping(), json_schema_extra=LATER)
    tugging: Tugging = Field(default=Tugging(), json_schema_extra=LATER)
    lagging: Lagging = Field(default=Lagging(), json_schema_extra=LATER)
    pace: Distribution = Distribution(low=0.7, high=1.2, nominal=1.0)
    """Speed of a path partner relative to the commanded one: below 1 it holds back, above 1 it pulls."""
    noise: NotNegative = Distribution(low=0.0, high=8.0, nominal=0.0)
    """Standard deviation of the partner's random force, per horizontal axis [N]."""
    noise_resistance: float = Field(default=40.0, gt=0.0)
    """Rolling resistance at which the random force is as large in a push as in a lift [N]; the force in a push is
    proportional to the resistance. The default is that of the nominal crate."""
    noise_time: float = Field(default=0.5, gt=0.0)
    """Correlation time of the random force [s]."""
    leash: float = Field(default=0.15, gt=0.0)
    """Largest distance of the partner's target from the handle, horizontally and vertically [m]; people wait for one
    another."""
    strongest: float = Field(default=80.0, ge=0.0)
    """Bound on the force of spring and damper, horizontal and vertical [N]."""
    hand_distance: float = Field(default=0.25, gt=0.0, json_schema_extra=LATER)
    """Distance of each of the partner's hands from their midpoint [m]: the lever arm of the springs that turn the
    object. Used for steered partners only."""
    push_yielding: float = Field(default=0.5, ge=0.0)
    """Bound on that force in a push, as a fraction of the partner's share of the resistance, so that a helping partner
    does not do all the work."""
    stability: float = Field(default=0.3, gt=0.0, le=1.0)
    """Bound on damping · period / mass and stiffness · period² / mass, with the effective mass at the handle. Above it,
    a force held over a control period would make a light object oscillate."""

    def problems(self) -> Problems:
        if self.longest_delay > LONGEST_DELAY:
            yield "delay", f"should be 0 to {LONGEST_DELAY:g} s"

    @property
    def longest_delay(self) -> float:
        """Longest delay that may be drawn or held [s]."""
        return max(self.delay.high, self.delay.nominal, self.lagging.delay)
