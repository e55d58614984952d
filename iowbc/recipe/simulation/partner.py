"""The second carrier, at the object's far handle."""

from pydantic import Field

from iowbc.recipe.section import Section
from iowbc.recipe.simulation.distribution import Distribution


TRAINED = ("path", "follower", "leader", "stopping")
"""Behaviours that training may draw."""
BEHAVIOURS = (*TRAINED, "tugging", "lagging")
"""All behaviours; a trial holds `partner_behaviour` at a place in this list. The last two are for evaluation alone."""


class Partner(Section):
    """A compliant carrier: a spring, a damper and a preload at the far handle, on the path and at the height that the
    commands describe from where the episode began."""

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
    """Time by which the partner lags behind the commanded motion [s]; human reaction times."""
    pace: Distribution = Distribution(low=0.7, high=1.2, nominal=1.0)
    """Speed of the partner as a part of the commanded one: below 1 it holds back, above 1 it pulls."""
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
    push_yielding: float = Field(default=0.5, ge=0.0)
    """Bound on that force in a push, as a part of the partner's share of the resistance: who helps does not do it
    all."""
    stability: float = Field(default=0.3, gt=0.0, le=1.0)
    """Bound on damping · period / mass and on stiffness · period² / mass, with the mass felt at the handle, above which
    a force that is held over a control period would make a light object oscillate."""
