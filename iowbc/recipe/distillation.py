"""On-policy distillation of the teacher into the student (paper eq. 7)."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from iowbc.recipe.section import COSMETIC, DEEPEST, LATER, ArtifactName, Encoder, Width


class Distillation(Encoder):
    """On-policy distillation of the teacher into the student."""

    steps: int = Field(default=4_000_000, ge=1, le=10**12)
    """Environment steps, summed over the environments."""
    environments: int = Field(default=96, ge=1, le=100_000)
    """Parallel environments."""
    rollout: int = Field(default=32, ge=1, le=10_000)
    """Control steps between two rounds of gradient steps."""
    history: int = Field(default=25, ge=1, le=1000)
    """Length of the observation history H_t (paper Table I)."""
    experts: dict[str, ArtifactName] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """By scene: the recipe whose teacher the student follows there, or a key as in `teacher.start`. Empty follows this
    recipe's own teacher everywhere. What the experts are is part of the key, not what they are called."""
    start: Literal["teacher", "anew"] = "teacher"
    """Beginning of the body behind the encoder. `teacher`: the teacher's own body; where that sees s_priv, it sees
    a linear estimate from the latent, at first the mean of training, so that training begins with the teacher's
    behaviour. `anew`: random weights, with the latent as input."""
    hidden: tuple[Width, ...] = Field(default=(512, 256, 128), max_length=DEEPEST)
    """Hidden layers behind the encoder (paper Table I), where they start anew; else they are the teacher's."""
    activation: Literal["elu", "relu", "tanh"] = "elu"
    """Activation of the encoder, and of the hidden layers where they start anew."""
    learning_rate: float = Field(default=5e-4, gt=0)
    """Adam's learning rate at the start; it falls to a tenth along a cosine."""
    gradient_norm: float = Field(default=1.0, gt=0)
    """Largest norm of a gradient step."""
    batch: int = Field(default=1024, ge=1, le=10_000_000)
    """Samples of a gradient step, drawn from the whole buffer."""
    gradient_steps: int = Field(default=12, ge=1, le=100_000)
    """Gradient steps of one round."""
    buffer: int = Field(default=300_000, ge=1, le=100_000_000)
    """Samples that are kept, the newest."""
    teacher_share: float = Field(default=0.1, ge=0, le=1)
    """Part of the steps in which the teacher still drives some environments: all at first, none at the end."""
    withheld: tuple[str, ...] = Field(default=(), json_schema_extra=LATER)
    """Parts of s_priv, by name, that the teacher does not receive when it drives or answers: each is its mean in
    training. The student cannot react to what no history shows, such as a motor's strength; the teacher acts better
    without it."""
    observe_object: bool = Field(default=True, json_schema_extra=LATER)
    """Lets the student see the object where its teacher does (`task.observation.observe_object`). Without, it has
    proprioception alone (paper III-C.2), and infers the object's pose from its history as it infers s_priv."""
    std: Literal["learnt", "shared"] = "learnt"
    """Standard deviation of the student's Gaussian. `learnt`: its own, which grows where its action is uncertain
    (paper eq. 7). `shared`: the teacher's, and the loss is a squared error that it scales."""
    std_floor: float = Field(default=0.1, gt=0)
    """Least standard deviation of the two Gaussians in the KL divergence, in units of action: it scales the error."""
    auxiliary: float = Field(default=0.1, ge=0)
    """Weight of the mean squared error with which the object's mass and the base's velocity are read from the latent,
    each number in its standard deviations; 0 leaves it out. It makes the latent hold what the history shows."""
    seed: int | None = Field(default=None, ge=0, lt=2**32, json_schema_extra=LATER)
    """Seed of this training alone; the recipe's `seed` when empty."""
    checkpoint_every: int = Field(default=50, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Rounds between two checkpoints."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.batch > self.buffer:
            yield "", f"batch ({self.batch}) is larger than buffer ({self.buffer})"
