"""The second carrier, at the object's far handle."""

from collections.abc import Iterator

from pydantic import Field

from iowbc.recipe.section import LATER, Section
from iowbc.recipe.simulation.randomization import Distribution

LONGEST_DELAY = 10.0
"""Commands of so long a time are remembered at most [s]."""
TRAINED = ("path", "follower", "leader", "stopping")
"""Behaviours that training may draw."""
BEHAVIOURS = (*TRAINED, "tugging", "lagging")
"""All behaviours; a trial holds `partner_behaviour` at a place in this list. The last two are for evaluation alone."""


class Behaviours(Section):
    """Shares of the behaviours of a partner; only the proportions matter. An absent partner has the share 0."""

    path: float = Field(default=1.0, ge=0.0)
    """Follows the commanded motion and height from where the episode began, wherever the robot is."""
    follower: float = Field(default=0.0, ge=0.0)
    """Carries its share and moves with the handle: no horizontal force at a constant velocity."""
    leader: float = Field(default=0.0, ge=0.0)
    """Has a pace, a heading, a sideways drift and a height of its own, which the command does not contain."""
    stopping: float = Field(default=0.0, ge=0.0)
    """Follows the commanded motion, stops or reverses suddenly, and resumes."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if sum(share for _, share in self) <= 0.0:
            yield "", "every behaviour has the share 0: give at least one of them a positive share"


class Leader(Section):
    """Motion of a leading partner beside the commanded one."""

    pace: Distribution = Distribution(low=0.0, high=1.5, nominal=1.0)
    """Speed as a part of the commanded one: from standing to half as fast again."""
    turning: Distribution = Distribution(low=-0.03, high=0.03, nominal=0.0)
    """Yaw rate that is added to the commanded one while walking [rad/s]: up to half a radian of drift in a trial."""
    sideways: Distribution = Distribution(low=-0.1, high=0.1, nominal=0.0)
    """Velocity to the left that is added while walking [m/s]; up to half of the largest commanded one."""
    rise: Distribution = Distribution(low=0.0, high=0.06, nominal=0.0)
    """Amplitude of its own height profile, a sine [m]; hands rise and sink by this in a natural gait with a load."""
    rise_period: float = Field(default=4.0, gt=0.0)
    """Period of that profile [s]; three or four steps."""


class Stopping(Section):
    """A sudden stop of the partner."""

    begin: Distribution = Distribution(low=2.0, high=10.0, nominal=5.0)
    """Time of the stop in the episode [s]."""
    duration: Distribution = Distribution(low=1.0, high=4.0, nominal=2.5)
    """Time until the partner resumes [s]."""
    reverse: Distribution = Distribution(low=0.2, high=0.6, nominal=0.0, probability=0.5)
    """Backward speed during the stop as a part of the commanded one; 0 stands still."""
    catching_up: float = Field(default=1.0, gt=0.0)
    """Time in which the partner comes back to the handle after the stop [s]; without, it would hold back for ever."""


OWN_DRAWS: dict[str, type[Section]] = {"leader": Leader, "stopping": Stopping}
"""Sections of `PartnerSettings` with quantities that are drawn for an episode."""


class Tugging(Section):
    """Periodic pulls of a partner that otherwise follows the path."""

    force: float = Field(default=40.0, ge=0.0)
    """Horizontal force of a pull [N]; a firm pull of one arm, half of `strongest`."""
    interval: float = Field(default=2.0, gt=0.0)
    """Time from one pull to the next [s]."""
    duration: float = Field(default=0.5, gt=0.0)
    """Time that a pull lasts [s]; longer than a step, so that it cannot be waited out."""


class Lagging(Section):
    """A partner that reacts late and hardly damps."""

    delay: float = Field(default=0.6, ge=0.0)
    """Time by which it lags behind the commanded motion [s]: twice the largest that training draws."""
    damping: float = Field(default=0.25, ge=0.0)
    """Part of the drawn damping that it has."""


class PartnerSettings(Section):
    """A compliant carrier: a spring, a damper and a preload at the far handle. Its behaviour decides where it goes."""

    enabled: bool = True
    """Off leaves the robot alone with the object."""
    share: Distribution = Distribution(low=0.0, high=0.6, nominal=0.0, probability=0.7)
    """Share of a held object's weight that the partner bears; 0 means that nobody helps and the carrier is absent."""
    push_share: Distribution = Distribution(low=-0.3, high=0.6, nominal=0.0, probability=0.7)
    """In a push, the part of the rolling resistance that the partner overcomes; negative resists, 0 means absent."""
    share_drift: Distribution = Distribution(low=0.0, high=0.1, nominal=0.0)
    """Standard deviation with which the share wanders within an episode; nobody carries evenly."""
    drift_time: float = Field(default=3.0, gt=0.0)
    """Time in which the share wanders [s]; a few steps."""
    stiffness: Distribution = Distribution(low=100.0, high=600.0, nominal=300.0, shape="log-uniform")
    """Stiffness at the handle, horizontal and vertical [N/m]; that of human arms."""
    damping: Distribution = Distribution(low=20.0, high=100.0, nominal=50.0, shape="log-uniform")
    """Damping at the handle [N·s/m]."""
    delay: Distribution = Distribution(low=0.05, high=0.3, nominal=0.15)
    """Time by which the partner lags behind the commanded motion [s], up to 10; human reaction times."""
    behaviours: Behaviours = Field(default=Behaviours(), json_schema_extra=LATER)
    """Behaviours that are drawn for the episodes."""

    leader: Leader = Field(default=Leader(), json_schema_extra=LATER)
    """Motion of a leader."""
    stopping: Stopping = Field(default=Stopping(), json_schema_extra=LATER)
    """When a stopping partner stops."""
    tugging: Tugging = Field(default=Tugging(), json_schema_extra=LATER)
    """Pulls of a tugging partner; evaluation alone."""
    lagging: Lagging = Field(default=Lagging(), json_schema_extra=LATER)
    """Reaction of a lagging partner; evaluation alone."""
    pace: Distribution = Distribution(low=0.7, high=1.2, nominal=1.0)
    """Speed of a partner on the path as a part of the commanded one: below 1 it holds back, above 1 it pulls."""
    noise: Distribution = Distribution(low=0.0, high=8.0, nominal=0.0)
    """Standard deviation of the partner's unsteady force, per horizontal axis [N]."""
    noise_resistance: float = Field(default=40.0, gt=0.0)
    """Rolling resistance at which the unsteady force in a push is that of a lift [N], in proportion otherwise: the
    nominal crate's."""
    noise_time: float = Field(default=0.5, gt=0.0)
    """Correlation time of that force [s]."""
    leash: float = Field(default=0.15, gt=0.0)
    """Furthest that the partner's own aim runs ahead of the handle, horizontally and vertically [m]; people wait for
    one another."""
    strongest: float = Field(default=80.0, ge=0.0)
    """Bound on the force of spring and damper, horizontal and vertical [N]."""
    hand_distance: float = Field(default=0.25, gt=0.0, json_schema_extra=LATER)
    """Distance of the partner's hands from the middle between them [m], at which their springs turn the object; used
    where the partner is steered."""
    push_yielding: float = Field(default=0.5, ge=0.0)
    """Bound on that force in a push, as a part of the partner's share of the resistance: who helps does not do it
    all."""
    stability: float = Field(default=0.3, gt=0.0, le=1.0)
    """Bound on damping · period / mass and on stiffness · period² / mass, with the mass felt at the handle, above which
    a force that is held over a control period would make a light object oscillate."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if not all(0.0 <= value <= LONGEST_DELAY for value in (self.delay.low, self.delay.high, self.delay.nominal)):
            yield "delay", f"should be 0 to {LONGEST_DELAY:g} s"
