"""Proximal policy optimisation: settings that the controller's training and the skill's have in common."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import Section


class PPO(Section):
    """Settings of PPO with the same default in every training."""

    minibatches: int = Field(default=4, ge=1, le=100_000)
    """Parts into which a rollout is split for the gradient steps; must divide its samples."""
    epochs: int = Field(default=5, ge=1, le=1000)
    """Passes over a rollout."""
    activation: Literal["elu", "relu", "tanh"] = "elu"
    """Activation of the hidden layers."""
    gae_lambda: float = Field(default=0.95, ge=0, le=1)
    """Decay of the generalised advantage estimate (paper Table I)."""
    clip: float = Field(default=0.2, gt=0)
    """PPO's clip range of the probability ratio."""
    entropy: float = Field(default=0.0, ge=0)
    """Weight of the entropy bonus."""
    gradient_norm: float = Field(default=1.0, gt=0)
    """Largest gradient norm; larger gradients are clipped."""
    std_floor: float = Field(default=0.05, gt=0)
    """Smallest standard deviation of the action. A teacher that reaches a floor below half of `std_end` has stopped
    exploring and returns to its best policy; a higher floor may be reached."""
