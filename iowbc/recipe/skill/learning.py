"""Settings of the skill's training."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.ppo import PPO
from iowbc.recipe.section import COSMETIC, HiddenLayers, PositiveRange, Problems

LARGEST_ROLLOUT = 1_000_000
"""Largest number of decisions of an update; they are kept in memory."""


class SkillLearning(PPO):
    """Multi-agent PPO: decentralised policies of robot and human, a centralised value network in training."""

    algorithm: Literal["mappo", "happo", "ppo"] = "mappo"
    """`mappo`: both policies are updated simultaneously with the same advantages (Yu et al. 2022). `happo`: sequential
    updates; the second policy's advantages are weighted by the first one's change (Kuba et al. 2022). `ppo`: only the
    robot learns, always with scripted humans, and with a value function of its own observation."""
    steps: int = Field(default=400_000, ge=1, le=10**12)
    """Decisions of the training, summed over the games."""
    games: int = Field(default=32, ge=1, le=100_000)
    """Number of parallel games."""
    rollout: int = Field(default=100, ge=2, le=10_000)
    """Decisions of each game between two updates. Every rollout restarts all games, so that a resumed training needs no
    state of the simulation: what comes later in an episode than a rollout is long is not trained."""
    imitation_steps: int = Field(default=100_000, ge=0, le=10**12)
    """Initial decisions in which the robot learns by imitation instead of reward: it acts, and imitates the actions of
    a robot that knows the path (DAgger), while the value network is trained. With the reward only, 76,000 decisions
    changed nothing."""
    scripted_steps: int = Field(default=200_000, ge=0, le=10**12)
    """Initial decisions, including those of the imitation, in which all humans are scripted."""
    learnt_share: float = Field(default=0.5, ge=0, le=1)
    """Fraction of later episodes with the learnt human; the others have scripted humans, so that the robot does not
    learn to rely on one partner."""
    imitation_gradient_steps: int = Field(default=200, ge=1, le=100_000)
    """Gradient steps of the imitation after each rollout."""
    imitation_rate: float = Field(default=1e-3, gt=0)
    """Adam's learning rate of the imitation."""
    hidden: HiddenLayers = (128, 128)
    """Hidden layers of the policies and of the value network."""
    normalization_clip: float = Field(default=5.0, gt=0)
    """Bound to which normalized inputs are clipped [standard deviations]."""
    learning_rate: float = Field(default=6e-5, gt=0)
    """Initial learning rate of Adam for the policies; at 3e-4 the first update after imitation had a KL of 0.35."""
    value_learning_rate: float = Field(default=3e-4, gt=0)
    """Adam's learning rate for the value network."""
    desired_kl: float | None = Field(default=0.012, gt=0)
    """Target KL divergence of a policy update; adapts its learning rate as in `teacher.desired_kl`."""
    learning_rate_range: PositiveRange = (1e-5, 1e-3)
    """Smallest and largest learning rate with `desired_kl`."""
    gamma: float = Field(default=0.98, gt=0, lt=1)
    """Discount factor per decision; 0.98 is a horizon of ten seconds at 5 Hz."""
    initial_std: float = Field(default=0.4, gt=0)
    """Initial standard deviation of the actions, which range from -1 to 1."""
    seed: int | None = Field(default=None, ge=0, lt=2**32)
    """Seed of this training; empty: the recipe's `seed`."""
    checkpoint_every: int = Field(default=5, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Updates between two checkpoints."""

    def problems(self) -> Problems:
        samples = self.games * self.rollout
        if samples > LARGEST_ROLLOUT:
            yield "", f"games x rollout is {samples:,}; at most {LARGEST_ROLLOUT:,} are kept in memory"
        elif samples % self.minibatches:
            yield "", f"minibatches ({self.minibatches}) does not divide games x rollout ({samples})"
