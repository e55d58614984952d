"""Multi-agent PPO of the skill layer: a robot and a human, with one critic."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field, PositiveFloat

from iowbc.recipe.ppo import PPO
from iowbc.recipe.section import COSMETIC, DEEPEST, Width

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
    """Decisions of each game between two updates. All games begin anew with each rollout, so that a resumed training
    needs no state of the simulation; an episode should therefore fit into one."""
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
