"""The Markov decision process: action, observation, termination, and the sections in the other files."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from iowbc.recipe.beside import CustomFunction
from iowbc.recipe.section import LATER, CustomName, NamedEntries, PositiveRange, Problems, Section
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.curriculum import Curriculum
from iowbc.recipe.task.joint_references import References
from iowbc.recipe.task.reward import Reward


class Action(Section):
    """The residual action: joint position increments of the 15 support joints."""

    scale: float | None = Field(default=None, gt=0.0)
    """Radians of joint target per unit of action, for every joint; empty: each joint's scale from `robot.yaml`."""
    bound: float = Field(default=5.0, gt=0.0)
    """Actions are clipped to plus and minus this, in units of action."""
    previous_share: float = Field(default=0.0, ge=0.0, le=0.5, json_schema_extra=LATER)
    """Share of the previous action in the joint targets, θ_S_ref + scale·((1 − p)·a_t + p·a_(t−1)). At 0.5 nothing
    that alternates from step to step reaches the motors, which follow half a step later. 0: none, as in the paper."""


class CustomPart(CustomFunction):
    """Custom part of s_priv: a function in a user's file. It takes the `Truth` (iowbc/task/privileged.py) of n
    environments and returns k values for each, (n, k)."""

    mirror: tuple[Literal[-1, 1], ...] = Field(min_length=1, max_length=256)
    """Signs of the k values under left-right mirroring, (k,): −1 for a value that changes its sign, such as a lateral
    component, roll or yaw; otherwise 1. Replace left and right values by their mean (sign 1) and difference (−1)."""


class Observation(Section):
    """Observations of policy and teacher."""

    observe_object: bool = True
    """Include the object's pose and rates in the base frame in s_t (eq. 5); otherwise teacher and student have
    proprioception only. `distill.observe_object` sets it for the student."""
    own: dict[CustomName, CustomPart] = Field(default_factory=dict, json_schema_extra=LATER)
    """Custom parts of s_priv by name; they are executed only to train or run a policy that observes s_priv."""


class Termination(Section):
    """Conditions of early termination, and of a fall or a drop in evaluation."""

    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {"lag": None, "lag_time": 3.0}

    pelvis_height: float = Field(default=0.3, ge=0.0)
    """Height of the pelvis below which the robot has fallen [m]."""
    pelvis_tilt: float = Field(default=1.3, gt=0.0)
    """Tilt of the pelvis beyond which the robot has fallen [rad]; large, since deep torso pitch tilts it too."""
    torso_roll: float = Field(default=0.8, gt=0.0)
    """Tilt of the torso to a side, at any pitch, beyond which the robot has fallen [rad]."""
    torso_pitch_error: float = Field(default=0.9, gt=0.0)
    """Torso pitch error beyond which the robot has fallen [rad]."""
    heading_error: float | None = Field(default=1.2, gt=0.0)
    """Heading error against the integrated command that ends an episode [rad]; it costs as much as a fall. Empty:
    no limit. It applies only if the command is feasible: not in a push, above level 1 of locomotion, or in trials."""
    object_distance: float = Field(default=0.35, gt=0.0)
    """Distance of a held object from its place in the grasp beyond which it counts as dropped [m]."""
    object_beside: float | None = Field(default=None, gt=0.0, json_schema_extra=LATER)
    """Lateral distance of a pushed object from the hands beyond which it counts as dropped [m]; empty: no limit. It
    applies only in training, since a robot that walks on beside a lost crate does not learn to push."""


class SceneShares(NamedEntries):
    """Fraction of the environments with each scene of `simulation.scenes`; only the proportions matter."""

    __pydantic_extra__: dict[str, Annotated[float, Field(ge=0.0)]] = Field(init=False)
    free: float = Field(default=0.1, ge=0.0)
    """No object: only walking, standing and posture."""
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

    def problems(self) -> Problems:
        yield from super().problems()
        if sum(share for _, share in self) <= 0.0:
            yield "", "every share is zero: give at least one scene a positive share"


class Task(Section):
    """The Markov decision process: commands, observation, action, reward, terminations, curriculum."""

    control_frequency: float = Field(default=50.0, gt=0.0, le=500.0)
    """Rate at which the policy acts [Hz]; must divide the physics rate."""
    episode_duration: PositiveRange = (10.0, 20.0)
    """Range of the random time limit of an episode [s]; a spread desynchronizes the environments."""
    scenes: SceneShares = SceneShares()
    commands: Commands = Commands()
    references: References = References()
    action: Action = Action()
    observation: Observation = Observation()
    reward: Reward = Reward()
    termination: Termination = Termination()
    curriculum: Curriculum = Curriculum()
