"""The skill layer of a recipe: tasks, agents and reward of the Markov game."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PositiveFloat

from iowbc.recipe.section import COSMETIC, LATER, ArtifactName, Ascending, Distinct, Problems, Section, Share
from iowbc.recipe.simulation.holding import ObjectScene
from iowbc.recipe.simulation.partner import BEHAVIOURS, Behaviour
from iowbc.recipe.skill.learning import SkillLearning
from iowbc.recipe.skill.task import Tasks

Rival = Literal["nominal", "follow", "lead", "clock", "stand"]
"""Rules of `iowbc.skill.episodes.Plan` that act without a skill."""
PartnerKind = Literal[Behaviour, "agent"]
"""Behaviours of scripted humans, and `agent` for the human driven by actions."""
File = Annotated[str, Field(pattern=r".+\.ya?ml$", max_length=300)]
"""The file of another recipe."""


class SkillEvaluation(Section):
    """Comparison of trained skills and baselines, over all combinations of the listed values."""

    label: str = Field(default="MAPPO", min_length=1, max_length=40)
    """Name of this recipe's skill in tables and figures."""
    rivals: Annotated[tuple[Rival, ...], Distinct] = ("lead", "follow")
    """Rule-based baselines. `nominal`: the nominal command, which leads or follows. `lead`: a scripted leader that
    always knows the path. `follow`: an admittance follower. `clock`: the path by time. `stand`: standing still."""
    others: dict[str, tuple[ArtifactName, ...]] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """Other trained skills by label: recipes, or keys of their artifacts. Under this recipe's own label they are
    further trainings of it, such as other seeds. The key depends on the skills' content, not on these names."""
    controllers: dict[str, File] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """Other controllers for this recipe's skill, by label: recipes with `distill` whose student replaces the controller
    of its training. References, command ranges, action scale, control frequency and reference generator are those of
    the other recipe; simulation and the skill's observation are those of this recipe."""
    tasks: Annotated[tuple[str, ...], Distinct] = ()
    """Tasks of `skill.tasks`; empty: all."""
    known: Annotated[tuple[bool, ...], Distinct] = (True, False)
    """Knowledge of the path: `true` if the robot has it, `false` if only the human does."""
    partners: Annotated[tuple[PartnerKind, ...], Distinct] = ()
    """Humans: scripted behaviours, and `agent` for the learnt one. Empty: those of training, those held out, and the
    learnt one."""
    loads: Annotated[tuple[Share, ...], Distinct] = Field(default=(0.5,), min_length=1)
    """Masses as fractions of the task's range: 0 is its lower end, 1 its upper end."""
    masses: dict[ObjectScene, Ascending] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses of a scene's tasks [kg], which replace `loads` and may lie outside the task's range."""
    episodes: int = Field(default=2, ge=1, le=1000)
    """Episodes of each combination."""
    seed: int = Field(default=7000, ge=0, lt=2**32)
    """Seed of the first episode; all skills and baselines have the same episodes."""
    games: int = Field(default=48, ge=1, le=10_000, json_schema_extra=COSMETIC)
    """Games that are played at the same time."""


class GameReward(Section):
    """Potential-based reward minus costs over time, shared by both agents."""

    progress: float = Field(default=1.0, ge=0.0)
    """Potential per metre of the path covered by the object [1/m]; the other weights are relative to it."""
    path: float = Field(default=0.5, ge=0.0)
    """Loss of potential per metre of the object's distance from the path [1/m]; below `progress`, so that detours may
    pay."""
    yaw: float = Field(default=0.3, ge=0.0)
    """Loss of potential per radian of the object's yaw relative to the path's heading [1/rad]."""
    height: float = Field(default=2.0, ge=0.0)
    """Loss of potential per metre of height error of the object [1/m]; heights change by decimetres only."""
    success: float = Field(default=2.0, ge=0.0)
    """Reward of reaching the end: two thirds of a path's potential."""
    failure: float = Field(default=2.0, ge=0.0)
    """Cost of a fall, a drop or an object that strays from the path."""
    touch: float = Field(default=0.5, ge=0.0)
    """Cost per second of contact between the object and a wall [1/s]."""
    internal_force: float = Field(default=0.002, ge=0.0)
    """Cost of the horizontal internal force, in which both agents' forces cancel [1/(N·s)]: 20 N over 15 s cost as much
    as 0.6 m."""
    partner_work: float = Field(default=0.004, ge=0.0)
    """Cost of the absolute mechanical work of the human beyond its share [1/J]: 50 J cost as much as 0.2 m."""
    tilt: float = Field(default=0.1, ge=0.0)
    """Cost of the object's tilt over time [1/(rad·s)]."""
    jerk: float = Field(default=0.02, ge=0.0)
    """Cost of the mean squared change of the robot's action from decision to decision [1]; noise of 0.3 costs half
    a centimetre a decision."""
    time: float = Field(default=0.02, ge=0.0)
    """Cost of time [1/s]: standing still for 20 s costs 0.4 m."""


class RobotAgent(Section):
    """Nominal command of the robot, and limits of the action that modifies it."""

    velocity: tuple[PositiveFloat, PositiveFloat] = (0.25, 0.15)
    """Largest change of v_x and v_y by the action [m/s]."""
    yaw_rate: float = Field(default=0.25, gt=0.0)
    """Largest change of the yaw rate by the action [rad/s]."""
    height: float = Field(default=0.1, gt=0.0)
    """Largest change of the height by the action [m]."""
    pitch: float = Field(default=0.2, gt=0.0)
    """Largest change of the torso pitch by the action [rad]."""
    offset: float = Field(default=0.05, gt=0.0)
    """Largest change of a wrist offset by the action [m]."""
    push_pitch: float = 0.2
    """Torso pitch of the nominal command in a push [rad], that of the trials' sequences."""
    push_height: float | None = Field(default=None, gt=0.0, json_schema_extra=LATER)
    """Height of the nominal command in a push [m]; empty: the nominal height. At 0.66 m and a pitch of 0.4 rad
    `compliant_merged` pushes 80 kg at 0.63 of the pace, at 0.72 m and 0.2 rad at 0.44."""
    admittance: tuple[float, float] = (0.012, 0.008)
    """Admittance of a nominal follower: velocity per force on its hands, forward and to the left [m/(N·s)]: 30 N make
    it walk at 0.31 m/s with the default `deadband`."""
    deadband: float = Field(default=4.0, ge=0.0)
    """Force below which a nominal follower stands [N]; the force estimate has an error of this size."""
    push_force: float = Field(default=40.0, gt=0.0)
    """Target force of a nominal follower in a push [N]; it walks forward until its hands reach it."""
    alignment: float = Field(default=1.0, ge=0.0)
    """Yaw rate of a nominal follower per radian of the object's yaw in its heading frame [1/s]."""
    history: int = Field(default=5, ge=1, le=50)
    """Number of decisions whose estimated hand forces the robot observes."""


class HumanAgent(Section):
    """The human: its strength, and limits of the learnt human's deviation from the scripted motion along the path."""

    strongest: float = Field(default=50.0, gt=0.0)
    """Bound on the force of spring and damper of its arms [N]; it replaces `simulation.partner.strongest`. Even with
    its share of the resistance, it cannot move the crate alone."""
    velocity: float = Field(default=0.3, gt=0.0)
    """Largest change of the horizontal velocity of the handle, per axis [m/s]: as fast as the script walks."""
    vertical_velocity: float = Field(default=0.1, gt=0.0)
    """Largest change of the vertical velocity of the handle [m/s], and the script's largest."""
    height: float = Field(default=0.1, gt=0.0)
    """Largest offset of the handle's height from the integrated vertical velocity [m]."""
    yaw_rate: float = Field(default=0.3, gt=0.0)
    """Largest change of the yaw rate that the human gives the object [rad/s]."""
    hand_time: float = Field(default=0.15, gt=0.0, json_schema_extra=LATER)
    """Time constant with which a human player's spring follows the mouse [s]; browsers send events every 0.05 s."""


class PathFollowing(Section):
    """Path following of scripted agents that know the path."""

    speed: float = Field(default=0.3, gt=0.0)
    """Speed along the path [m/s]; a little more than half of what the controller is trained for."""
    slowing: float = Field(default=0.4, gt=0.0)
    """Distance from the end at which agents slow down [m]."""
    lateral: float = Field(default=0.6, ge=0.0)
    """Velocity towards the path per metre of distance from it [1/s]."""
    yaw: float = Field(default=0.8, ge=0.0)
    """Yaw rate per radian of heading error [1/s]."""
    vertical: float = Field(default=1.0, ge=0.0)
    """Vertical velocity of the handle per metre of the object's height error [1/s]."""
    ahead: float = Field(default=0.3, ge=0.0)
    """Look-ahead distance for the path's height [m]; a second of walking."""
    waypoints: tuple[float, float] = (0.5, 1.0)
    """Distances ahead of the next two waypoints that agents observe [m]."""


class Finish(Section):
    """Conditions that end a game."""

    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {"walls": "cost"}

    distance: float = Field(default=0.15, gt=0.0)
    """Distance along the path from its end that counts as reached [m]."""
    lateral: float = Field(default=0.2, gt=0.0)
    """Largest distance from the path at the end [m]."""
    yaw: float = Field(default=0.3, gt=0.0)
    """Largest deviation from the path's heading at the end [rad]."""
    height: float = Field(default=0.08, gt=0.0)
    """Largest distance from the path's height at the end [m], for an object that is carried."""
    stray: float = Field(default=1.0, gt=0.0)
    """Distance from the path at which the game ends [m]."""


class PartnerKinds(Section):
    """Humans in training and in evaluation."""

    training: tuple[PartnerKind, ...] = ("path", "follower", "leader", "stopping")
    """Humans of training."""
    held_out: tuple[PartnerKind, ...] = ("tugging", "lagging")
    """Humans of the evaluation only."""

    def problems(self) -> Problems:
        if both := set(self.training) & set(self.held_out):
            yield "", f"{', '.join(sorted(both))}: both in training and held out; name it once"
        if not self.training:
            yield "", f"training: name at least one of {', '.join(BEHAVIOURS)}, agent"


class Skill(Section):
    """The skill layer: the Markov game of a robot and a human who transport an object together."""

    frequency: float = Field(default=5.0, gt=0.0)
    """Decision frequency [Hz]; the control frequency is an integer multiple of it."""
    tasks: Tasks = Tasks()
    goal_known: float = Field(default=0.5, ge=0.0, le=1.0)
    """Fraction of the games in which the robot knows the path, besides all with a follower; in the others only the
    human does."""
    partners: PartnerKinds = PartnerKinds()
    robot: RobotAgent = RobotAgent()
    human: HumanAgent = HumanAgent()
    pursuit: PathFollowing = PathFollowing()
    finish: Finish = Finish()
    reward: GameReward = GameReward()
    learning: SkillLearning = SkillLearning()
    eval: SkillEvaluation = SkillEvaluation()
