"""When a trial counts as a success."""

from pydantic import Field

from iowbc.recipe.section import COSMETIC, LATER, Section


class Success(Section):
    """Survival: no fall and nothing dropped, by `task.termination`, for the whole trial. Success: survival and
    transport of what the hands carry or do not lose, or, where a push is infeasible, survival and posture."""

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
    posture_pitch: float = Field(default=0.3, gt=0)
    """Largest mean error of the torso pitch of a stagnating push that is a success [rad]; twice the paper's E_α."""
    posture_height: float = Field(default=0.05, gt=0)
    """Largest mean error of the height of a stagnating push that counts as success [m]; 2.5 times the paper's E_h."""
    capacity_rate: float = Field(default=0.8, gt=0, le=1, json_schema_extra=COSMETIC)
    """Success rate that a mass, and every lighter one, must reach to count as carried (load capacity)."""
