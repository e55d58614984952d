"""PPO with privileged information (paper section III-C, Table I)."""

from typing import Literal

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from iowbc.recipe.section import COSMETIC, Section


class Teacher(Section):
    """PPO with privileged information."""

    steps: int = Field(default=30_000_000, ge=1)
    """Environment steps of the whole training, summed over the environments."""
    environments: int = Field(default=96, ge=1)
    """Parallel environments (paper: 2048). Few environments with many updates learn from fewer samples."""
    rollout: int = Field(default=48, ge=2)
    """Control steps that each environment contributes to one update."""
    minibatches: int = Field(default=4, ge=1)
    """Parts into which a rollout is split for the gradient steps; must divide environments x rollout."""
    epochs: int = Field(default=5, ge=1)
    """Passes over a rollout."""
    hidden: tuple[PositiveInt, ...] = (512, 256, 128)
    """Hidden layers of policy and value network (paper Table I)."""
    learning_rate: float = Field(default=2e-4, gt=0)
    """Adam's step size at the start (paper Table I)."""
    desired_kl: float | None = Field(default=0.04, gt=0)
    """KL divergence that an update should have: the step size falls by a fifth beyond one and a half times as much, and
    rises by a fifth below two thirds. At 0.02 to 0.04 training is stable, below 0.02 it is several times slower; empty
    keeps the step size constant."""
    learning_rate_range: tuple[PositiveFloat, PositiveFloat] = (2e-5, 1e-3)
    """Least and largest step size, where `desired_kl` moves it."""
    gamma: float = Field(default=0.99, gt=0, lt=1)
    """Discount factor (paper Table I)."""
    gae_lambda: float = Field(default=0.95, ge=0, le=1)
    """Decay of the generalised advantage estimate (paper Table I)."""
    clip: float = Field(default=0.2, gt=0)
    """PPO's clip range of the probability ratio."""
    entropy: float = Field(default=0.0, ge=0)
    """Weight of the entropy bonus."""
    value_weight: float = Field(default=0.5, ge=0)
    """Weight of the value loss."""
    gradient_norm: float = Field(default=1.0, gt=0)
    """Largest norm of a gradient step."""
    largest_kl: float | None = Field(default=0.15, gt=0)
    """An update ends before its last epoch where the KL divergence passes this; empty never does."""
    initial_std: float = Field(default=0.5, gt=0)
    """Initial standard deviation of the action, in units of the action (before the action scale)."""
    activation: Literal["elu", "relu", "tanh"] = "elu"
    """Activation of the hidden layers."""
    symmetry: Literal["none", "augment"] = "augment"
    """`augment` also learns from the left-right mirror image of every sample."""
    normalization_clip: float = Field(default=10.0, gt=0)
    """Normalised observations are clipped to this many standard deviations."""
    checkpoint_every: int = Field(default=20, ge=1, json_schema_extra=COSMETIC)
    """Updates between two checkpoints."""

    @model_validator(mode="after")
    def _range_ascends(self) -> "Teacher":
        low, high = self.learning_rate_range
        if low > high:
            raise ValueError(f"learning_rate_range: the least step size {low:g} is above the largest {high:g}")
        return self

    @model_validator(mode="after")
    def _minibatches_divide(self) -> "Teacher":
        samples = self.environments * self.rollout
        if samples % self.minibatches:
            raise ValueError(f"minibatches: {self.minibatches} does not divide environments x rollout = {samples}")
        return self
