"""The Markov decision process: action, observation, termination, and the sections of the other files."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field

from iowbc.recipe.beside import OwnFunction
from iowbc.recipe.section import LATER, NamedEntries, OwnName, Section
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.curriculum import Curriculum
from iowbc.recipe.task.joint_references import References
from iowbc.recipe.task.reward import Reward


class Action(Section):
    """The residual action: joint position increments of the 15 support joints."""

    scale: float | None = Field(default=None, gt=0.0)
    """Radians of joint target per unit of action, for every joint; empty takes each joint's scale from `robot.yaml`."""
    bound: float = Field(default=5.0, gt=0.0)
    """Actions are clipped to plus and minus this, in units of action."""


class OwnPart(OwnFunction):
    """A part of s_priv that is a function in a file of one's own. It takes the `Truth` (iowbc/task/privileged.py) of n
    environments and returns k values for each, (n, k)."""

    mirror: tuple[Literal[-1, 1], ...] = Field(min_length=1, max_length=256)
    """Signs of the k values when left and right change places, (k,): −1 where a value changes its sign, as a vector's
    lateral component, a roll or a yaw does; 1 where it does not. Of a left and a right value give the mean, whose sign
    is 1, and the difference, whose sign is −1."""


class Observation(Section):
    """Observations of policy and teacher."""

    observe_object: bool = True
    """Puts into s_t the object's pose and rates in the base frame (eq. 5); otherwise teacher and student have
    proprioception alone. `distill.observe_object` is for the student."""
    own: dict[OwnName, OwnPart] = Field(default_factory=dict, json_schema_extra=LATER)
    """Parts of s_priv of one's own, by name; only what trains or plays a policy that sees s_priv executes them."""


class Termination(Section):
    """When an episode ends early, and what counts as a fall or a drop in evaluation."""

    pelvis_height: float = Field(default=0.3, ge=0.0)
    """Pelvis below this is a fall [m]."""
    pelvis_tilt: float = Field(default=1.3, gt=0.0)
    """Pelvis further than this from upright is a fall [rad]; wide, because deep torso pitch tilts the pelvis too."""
    torso_roll: float = Field(default=0.8, gt=0.0)
    """Torso rolled further than this is a fall [rad]."""
    torso_pitch_error: float = Field(default=0.9, gt=0.0)
    """Torso pitch further than this from its command is a fall [rad]."""
    lag: float | None = Field(default=None, gt=0.0)
    """An episode ends when robot and object are this far behind the command [m], forgotten with the time constant
    `lag_time`; empty never ends one. It costs like a fall, so that standing is no safe answer to a command to walk.
    Nothing that the policy observes shows the lag; with 0.5 m walking was learnt later.
    Only where the command can be followed: not in a push, not above level 1 of locomotion, not in trials."""
    lag_time: float = Field(default=3.0, gt=0.0)
    """Time in which a lag is forgotten [s]: at 0.4 m/s a robot may stand in place for 1.6 s, and three fifths of the
    commanded speed are never too slow."""
    heading_error: float | None = Field(default=1.2, gt=0.0)
    """An episode ends when the heading is this far from the integrated command [rad]; where, and empty, as above."""
    object_distance: float = Field(default=0.35, gt=0.0)
    """A held object further than this from its place in the grasp is dropped [m]."""
    object_beside: float | None = Field(default=None, gt=0.0, json_schema_extra=LATER)
    """A pushed object further than this to the side of the hands is dropped [m]; empty never drops one. Only in
    training: a robot that goes on beside a lost crate learns nothing of pushing."""


class SceneShares(NamedEntries):
    """Part of the environments that plays each scene of `simulation.scenes`; only the proportions matter."""

    __pydantic_extra__: dict[str, Annotated[float, Field(ge=0.0)]] = Field(init=False)
    free: float = Field(default=0.1, ge=0.0)
    """No object: walking, standing and posture alone."""
    lift: float = Field(default=0.9, ge=0.0)
    """The box, held between the wrists."""
    squeeze: float = Field(default=0.0, ge=0.0)
    """The box, held between the palms by friction alone."""
    tyre: float = Field(default=0.0, ge=0.0)
    """The tyre, held between the wrists."""
    push: float = Field(default=0.0, ge=0.0)
    """The crate on wheels before the hands."""

    @classmethod
    def only(cls, scene: str) -> Self:
        return cls.model_validate(dict.fromkeys(cls.model_fields, 0.0) | {scene: 1.0})

    def problems(self) -> Iterator[tuple[str, str]]:
        yield from super().problems()
        if sum(share for _, share in self) <= 0.0:
            yield "", "every share is zero: give at least one scene a positive share"


class Task(Section):
    """The Markov decision process: commands, observation, action, reward, terminations, curriculum."""

    control_frequency: float = Field(default=50.0, gt=0.0, le=500.0)
    """Rate at which the policy acts [Hz]; must divide the physics rate."""
    episode_duration: tuple[float, float] = (10.0, 20.0)
    """Range from which the time limit of an episode is drawn [s]; a spread keeps environments out of step."""
    scenes: SceneShares = SceneShares()
    """Scenes that the environments play."""
    commands: Commands = Commands()
    """The 11-D skill-level command and how it is drawn."""
    references: References = References()
    """Joint references that follow from a command: base grasp, arm kinematics, reference generator, gait prior."""
    action: Action = Action()
    """The residual action."""
    observation: Observation = Observation()
    """Observations of policy and teacher."""
    reward: Reward = Reward()
    """Terms and weights of the reward."""
    termination: Termination = Termination()
    """When an episode ends early."""
    curriculum: Curriculum = Curriculum()
    """The three phases of training."""
