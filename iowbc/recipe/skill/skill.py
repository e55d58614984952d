"""The skill layer of a recipe: tasks, agents and reward of the Markov game."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field, PositiveFloat

from iowbc.recipe.ppo import PPO
from iowbc.recipe.section import COSMETIC, DEEPEST, LATER, ArtifactName, Ascending, RecipeFile, Section, Width
from iowbc.recipe.simulation.holding import ObjectScene
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.skill.task import Tasks

LARGEST_ROLLOUT = 1_000_000
"""Decisions that are kept in memory for one update."""


class SkillLearning(PPO):
    """Multi-agent PPO: decentralised policies of robot and human, a centralised value network in training."""

    algorithm: Literal["mappo", "happo", "ppo"] = "mappo"
    """`mappo`: both policies learn at once from the same advantages (Yu et al. 2022). `happo`: one after the other, the
    later one with its advantages weighted by what the earlier one changed (Kuba et al. 2022). `ppo`: the robot alone,
    against scripted humans throughout, with a value of its own observation."""
    steps: int = Field(default=400_000, ge=1, le=10**12)
    """Decisions of the whole training, summed over the games."""
    games: int = Field(default=32, ge=1, le=100_000)
    """Games that are played at the same time."""
    rollout: int = Field(default=100, ge=2, le=10_000)
    """Decisions of each game between two updates. Every rollout restarts all games, so that a resumed training needs no
    state of the simulation; an episode should therefore fit into one."""
    imitation_steps: int = Field(default=100_000, ge=0, le=10**12)
    """First decisions, in which the robot does not learn from the reward: it acts, and imitates what it would do if it
    knew the path (DAgger), while the value learns. From the reward alone 76,000 decisions had changed nothing."""
    scripted_steps: int = Field(default=200_000, ge=0, le=10**12)
    """First decisions, those of the imitation included, in which every human is a scripted one."""
    learnt_share: float = Field(default=0.5, ge=0, le=1)
    """Part of the episodes in which the learnt human acts afterwards; the robot goes on meeting scripted ones in the
    others, so that it does not learn to rely on one partner."""
    imitation_gradient_steps: int = Field(default=200, ge=1, le=100_000)
    """Gradient steps of the imitation after each rollout."""
    imitation_rate: float = Field(default=1e-3, gt=0)
    """Adam's learning rate of the imitation."""
    hidden: tuple[Width, ...] = Field(default=(128, 128), max_length=DEEPEST)
    """Hidden layers of the policies and of the value network."""
    normalization_clip: float = Field(default=5.0, gt=0)
    """Normalised inputs are clipped to this many standard deviations."""
    learning_rate: float = Field(default=6e-5, gt=0)
    """Adam's learning rate of the policies at the start; at 3e-4 the first update after the imitation had a KL
    divergence of 0.35."""
    value_learning_rate: float = Field(default=3e-4, gt=0)
    """Adam's learning rate of the value."""
    desired_kl: float | None = Field(default=0.012, gt=0)
    """KL divergence that an update of a policy should have; moves its learning rate as in `teacher.desired_kl`."""
    learning_rate_range: tuple[PositiveFloat, PositiveFloat] = (1e-5, 1e-3)
    """Least and largest learning rate, where `desired_kl` moves it."""
    gamma: float = Field(default=0.98, gt=0, lt=1)
    """Discount factor of a decision; 0.98 looks ten seconds ahead at 5 Hz."""
    initial_std: float = Field(default=0.4, gt=0)
    """Initial standard deviation of the actions, which range from -1 to 1."""
    seed: int | None = Field(default=None, ge=0, lt=2**32)
    """Seed of this training alone; the recipe's `seed` when empty."""
    checkpoint_every: int = Field(default=5, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Updates between two checkpoints."""

    def problems(self) -> Iterator[tuple[str, str]]:
        samples = self.games * self.rollout
        if samples > LARGEST_ROLLOUT:
            yield "", f"games x rollout is {samples:,}; at most {LARGEST_ROLLOUT:,} are kept in memory"
        elif samples % self.minibatches:
            yield "", f"minibatches ({self.minibatches}) does not divide games x rollout ({samples})"


Rival = Literal["nominal", "follow", "lead", "clock", "stand"]
"""Rules of `iowbc.skill.plan.Plan` that act without a skill."""


class SkillEvaluation(Section):
    """Games in which trained skills and rivals are compared: every combination of what is listed here."""

    label: str = Field(default="MAPPO", min_length=1, max_length=40)
    """Name of this recipe's skill in tables and figures."""
    rivals: tuple[Rival, ...] = ("lead", "follow")
    """Rules that play beside it. `nominal`: the nominal command alone, which leads or follows. `lead`: a scripted
    leader, who knows the path in any case. `follow`: an admittance follower. `clock`: the path by the clock. `stand`:
    nothing."""
    others: dict[str, tuple[ArtifactName, ...]] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """By label: recipes whose trained skills play, too, or keys of theirs. Under this recipe's own label they are
    further trainings of it, such as other seeds. What they are is part of the key, not what they are called."""
    controllers: dict[str, RecipeFile] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """By label: recipes with `distill` whose student this recipe's skill also commands, in place of the controller that
    it was trained with. Each brings its references, command ranges, action scale, control frequency and reference
    generator; the world and the skill's observation stay those of this recipe."""
    tasks: tuple[str, ...] = ()
    """Tasks of `skill.tasks`; all where it is empty."""
    known: tuple[bool, ...] = (True, False)
    """Cases of knowledge: `true` if the robot knows the path, `false` if only the human does."""
    partners: tuple[str, ...] = ()
    """Humans: scripted behaviours, and `agent` for the learnt one; those of training, those held out, and the learnt
    one where it is empty."""
    loads: tuple[float, ...] = Field(default=(0.5,), min_length=1)
    """Masses as places in the range of the task: 0 is its least, 1 its greatest."""
    masses: dict[ObjectScene, Ascending] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses of the tasks of a scene [kg], which may lie outside the range of the task; in place of `loads`."""
    episodes: int = Field(default=2, ge=1, le=1000)
    """Episodes of each combination."""
    seed: int = Field(default=7000, ge=0, lt=2**32)
    """Seed of the first episode; the same episodes for every skill and rival."""
    games: int = Field(default=48, ge=1, le=10_000, json_schema_extra=COSMETIC)
    """Games that are played at the same time."""


PartnerKind = Literal["path", "follower", "leader", "stopping", "tugging", "lagging", "agent"]
"""Behaviours of scripted humans, and the human of the actions."""


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


class RobotAgent(Section):
    """Nominal command of the robot, and how far its action departs from it."""

    velocity: tuple[float, float] = (0.25, 0.15)
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
    admittance: tuple[float, float] = (0.012, 0.008)
    """Velocity of a nominal follower for a force on its hands, forward and to the left [m/(N·s)]: 30 N make it walk at
    0.36 m/s."""
    deadband: float = Field(default=4.0, ge=0.0)
    """Force below which a nominal follower stands [N]; the estimate of force errs by as much."""
    push_force: float = Field(default=40.0, gt=0.0)
    """Force that a nominal follower in a push approaches [N]; it goes forward until its hands meet it."""
    alignment: float = Field(default=1.0, ge=0.0)
    """Yaw rate of a nominal follower for the object's yaw in its heading frame [1/s]."""
    history: int = Field(default=5, ge=1, le=50)
    """Decisions over which the robot observes the estimated forces on its hands."""


class HumanAgent(Section):
    """The human: its strength, and how far the learnt one's action departs from the scripted way along the path."""

    strongest: float = Field(default=50.0, gt=0.0)
    """Bound on the force of spring and damper of its arms [N], in place of `simulation.partner.strongest`: with its
    share of the resistance it does not move the crate alone."""
    velocity: float = Field(default=0.3, gt=0.0)
    """Largest change of the horizontal velocity of the handle, per axis [m/s]: as fast as the script walks."""
    vertical_velocity: float = Field(default=0.1, gt=0.0)
    """Largest change of the vertical velocity of the handle [m/s], and the script's largest."""
    height: float = Field(default=0.1, gt=0.0)
    """Largest offset of the handle's height from what the vertical velocity has led to [m]."""
    yaw_rate: float = Field(default=0.3, gt=0.0)
    """Largest change of the yaw rate that the human gives the object [rad/s]."""
    hand_time: float = Field(default=0.15, gt=0.0, json_schema_extra=LATER)
    """Time in which the spring of a person who plays by hand follows the mouse [s]; events of a browser come every
    0.05 s."""


class Pursuit(Section):
    """How scripted agents that know the path move along it."""

    speed: float = Field(default=0.3, gt=0.0)
    """Speed along the path [m/s]; a little more than half of what the controller is trained for."""
    slowing: float = Field(default=0.4, gt=0.0)
    """Distance from the end at which it slows down [m]."""
    lateral: float = Field(default=0.6, ge=0.0)
    """Velocity towards the path for the distance from it [1/s]."""
    yaw: float = Field(default=0.8, ge=0.0)
    """Yaw rate for the deviation from the path's heading [1/s]."""
    vertical: float = Field(default=1.0, ge=0.0)
    """Vertical velocity of the handle for the object's distance from the path's height [1/s]."""
    ahead: float = Field(default=0.3, ge=0.0)
    """Distance ahead at which the path's heading and height are read [m]; a second of walking."""
    waypoints: tuple[float, float] = (0.5, 1.0)
    """Distances ahead of the next two waypoints that agents observe [m]."""


class Finish(Section):
    """When a game ends."""

    distance: float = Field(default=0.15, gt=0.0)
    """Distance along the path from its end that counts as reached [m]."""
    lateral: float = Field(default=0.2, gt=0.0)
    """Largest distance from the path at the end [m]."""
    yaw: float = Field(default=0.3, gt=0.0)
    """Largest deviation from the path's heading at the end [rad]."""
    height: float = Field(default=0.08, gt=0.0)
    """Largest distance from the path's height at the end [m], for an object that is carried."""
    walls: Literal["end", "cost"] = "cost"
    """Consequence of an object's corner in a wall: the end of the game, or a cost by time."""
    stray: float = Field(default=1.0, gt=0.0)
    """Distance from the path at which the game ends [m]."""


class PartnerKinds(Section):
    """Humans in training and in evaluation."""

    training: tuple[PartnerKind, ...] = ("path", "follower", "leader", "stopping")
    """Humans of training."""
    held_out: tuple[PartnerKind, ...] = ("tugging", "lagging")
    """Humans that only the evaluation plays."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if both := set(self.training) & set(self.held_out):
            yield "", f"{', '.join(sorted(both))}: both in training and held out; name it once"
        if not self.training:
            yield "", f"training: name at least one of {', '.join(BEHAVIOURS)}, agent"


class Skill(Section):
    """The Markov game of a robot and a human who transport an object together."""

    frequency: float = Field(default=5.0, gt=0.0)
    """Decisions a second [Hz]; the control frequency is a whole multiple of it."""
    tasks: Tasks = Tasks()
    """Transport tasks by name."""
    goal_known: float = Field(default=0.5, ge=0.0, le=1.0)
    """Part of the games in which the robot knows the path; in the others only the human does."""
    partners: PartnerKinds = PartnerKinds()
    """Humans of training and evaluation."""
    robot: RobotAgent = RobotAgent()
    """The robot's nominal command and action."""
    human: HumanAgent = HumanAgent()
    """The human's action."""
    pursuit: Pursuit = Pursuit()
    """Motion of scripted agents along the path."""
    finish: Finish = Finish()
    """When a game ends."""
    reward: GameReward = GameReward()
    """The shared reward."""
    learning: SkillLearning = SkillLearning()
    """Multi-agent PPO of robot and human."""
    eval: SkillEvaluation = SkillEvaluation()
    """Games in which skills and rivals are compared."""
