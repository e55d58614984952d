"""The shared reward of robot and human."""

from pydantic import Field

from iowbc.recipe.section import Section


class GameReward(Section):
    """Differences of a potential, less costs by time; both agents receive the same."""

    progress: float = Field(default=1.0, ge=0.0)
    """Potential of a metre of the path that the object has covered [1/m]; the other weights are relative to it."""
    path: float = Field(default=0.5, ge=0.0)
    """Potential lost by the object's distance from the path [1/m]; less than progress, so that a detour may pay."""
    yaw: float = Field(default=0.3, ge=0.0)
    """Potential lost by the object's yaw from the path's heading [1/rad]."""
    height: float = Field(default=2.0, ge=0.0)
    """Potential lost by the object's distance from the path's height [1/m]; heights change by decimetres only."""
    success: float = Field(default=2.0, ge=0.0)
    """Reward of reaching the end: two thirds of a path's potential."""
    failure: float = Field(default=2.0, ge=0.0)
    """Cost of a fall, a drop or a wall that ends the game."""
    touch: float = Field(default=0.5, ge=0.0)
    """Cost of a second in which the object touches a wall that does not end the game [1/s]."""
    internal_force: float = Field(default=0.002, ge=0.0)
    """Cost of the horizontal forces of both that cancel [1/(N·s)]: 20 N over 15 s cost as much as 0.6 m."""
    partner_work: float = Field(default=0.004, ge=0.0)
    """Cost of the size of the human's mechanical work beyond its share [1/J]: 50 J cost as much as 0.2 m."""
    tilt: float = Field(default=0.1, ge=0.0)
    """Cost of the object's tilt from upright by time [1/(rad·s)]."""
    jerk: float = Field(default=0.02, ge=0.0)
    """Cost of the mean squared change of the robot's action from decision to decision [1]; noise of 0.3 costs half
    a centimetre a decision."""
    time: float = Field(default=0.02, ge=0.0)
    """Cost of time [1/s]: standing still for 20 s costs 0.4 m."""
