"""When a trial counts as a success."""

from pydantic import Field

from iowbc.recipe.section import COSMETIC, LATER, Section


class Success(Section):
    """Survival: no fall and nothing dropped, by `task.termination`, for the whole trial. Success: survival and
    transport of what the hands carry or do not lose; beside a partner also bounded force; where a push is infeasible,
    survival, posture, feet that stay and a push that goes on. A robot that stands still never succeeds."""

    slip_fails: bool = False
    """Also count a trial as failed in which a hand ever lost the object, even though the other kept it."""
    transport: float = Field(default=0.5, ge=0, le=1)
    """Part of the commanded displacement that robot and object must cover; a robot that stands still covers none."""
    weight_in_hands: float = Field(default=0.95, ge=0, le=1)
    """Part of a held object's weight, less the partner's share, that must rest in the hands on average; the rest lies
    on thighs or torso."""
    object_beside: float = Field(default=0.35, gt=0, json_schema_extra=LATER)
    """A pushed object that is ever further than this to the robot's side is lost [m]: the middle of the hands is then
    past the edge of a crate that is 0.6 m wide. A held one may be as far from its place (`object_distance`)."""
    push_force: float = Field(default=0.5, ge=0, le=1)
    """Part of what friction allows that the hands push with in a stagnating push that is a success. Friction allows
    μ times the vertical force of the ground on both feet, or the crate's rolling resistance where that is smaller;
    both forces are averaged over a gait period."""
    push_time: float = Field(default=0.5, ge=0, le=1)
    """Part of the time in which steps are commanded for which they have to push so."""
    foot_slide: float = Field(default=0.1, gt=0)
    """Largest mean speed at which the loaded soles slide, both feet together, in a stagnating push that is a success
    [m/s]: twice that of a robot that walks."""
    handle_force: float = Field(default=50.0, gt=0)
    """Largest 95th percentile of the horizontal force between partner and object in a trial of compliance that is a
    success [N]: a little above the 40 N of a firm pull of one arm, well below the 80 N at which the partner's own
    arms give in."""
    hand_force: float = Field(default=90.0, gt=0)
    """Largest 95th percentile of the horizontal force at either hand before a blocked crate in such a trial [N]. Both
    together then push with 180 N at most, half of what the best ground of training (friction 1.2) allows."""
    least_push: float = Field(default=20.0, ge=0)
    """Least mean force of both hands before a blocked crate in such a trial, while steps are commanded [N]: a robot
    that does not push has nothing to yield to."""
    compliance_transport: float = Field(default=0.25, ge=0, le=1)
    """Part of the commanded displacement that robot and object must cover in such a trial: half of `transport`, for the
    partner stops, lags and leads elsewhere."""
    posture_pitch: float = Field(default=0.3, gt=0)
    """Largest mean error of the torso pitch of a stagnating push that is a success [rad]; twice the paper's E_α."""
    posture_height: float = Field(default=0.05, gt=0)
    """Largest mean error of the height of a stagnating push that counts as success [m]; 2.5 times the paper's E_h."""
    capacity_rate: float = Field(default=0.8, gt=0, le=1, json_schema_extra=COSMETIC)
    """Success rate that a mass, and every lighter one, must reach to count as carried (load capacity)."""
