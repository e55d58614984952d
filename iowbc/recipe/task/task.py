"""The Markov decision process."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from iowbc.recipe.section import Named, Section
from iowbc.recipe.task.action import Action
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.curriculum import Curriculum
from iowbc.recipe.task.joint_references import References
from iowbc.recipe.task.observation import Observation
from iowbc.recipe.task.reward import Reward
from iowbc.recipe.task.termination import Termination


class SceneShares(Named):
    """Which part of the environments plays which scene of `simulation.scenes`; only the proportions matter."""

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
        """One scene alone."""
        return cls.model_validate(dict.fromkeys(cls.model_fields, 0.0) | {scene: 1.0})

    @model_validator(mode="after")
    def _some_scene(self) -> Self:
        if sum(share for _, share in self) <= 0.0:
            raise ValueError("every share is zero: give at least one scene a positive share")
        return self


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
    """How a command becomes joint references: base grasp, arm kinematics, reference generator, gait prior."""
    action: Action = Action()
    """The residual action."""
    observation: Observation = Observation()
    """What policy and teacher see."""
    reward: Reward = Reward()
    """Terms and weights of the reward."""
    termination: Termination = Termination()
    """When an episode ends early."""
    curriculum: Curriculum = Curriculum()
    """The three phases of training."""
