"""On-policy distillation of the teacher into the student (paper eq. 7)."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import COSMETIC, LATER, ArtifactName, Encoder, HiddenLayers, Problems


class Distillation(Encoder):
    """On-policy distillation of the teacher into the student."""

    steps: int = Field(default=4_000_000, ge=1, le=10**12)
    """Environment steps, summed over the environments."""
    environments: int = Field(default=96, ge=1, le=100_000)
    """Parallel environments."""
    rollout: int = Field(default=32, ge=1, le=10_000)
    """Control steps of each environment between two rounds of gradient steps."""
    history: int = Field(default=25, ge=1, le=1000)
    """Length of the observation history H_t (paper Table I)."""
    experts: dict[str, ArtifactName] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """Teachers by scene: a recipe whose teacher the student imitates in that scene, or a key as in `teacher.start`.
    Empty: this recipe's own teacher in all scenes. One that PPO trained on its history (`teacher.history`) can be
    imitated without error; if it is the first, the student starts as its copy. Use `auxiliary: 0` if all are such, as
    they do not know the scale of the facts. The key depends on the teachers' content, not on these names."""
    start: Literal["teacher", "anew"] = "teacher"
    """Initial weights of the layers behind the encoder. `teacher`: the teacher's own layers; their input s_priv is
    replaced by a linear estimate from the latent, which is initially the training mean, so that training begins with
    the teacher's behaviour. `anew`: random weights, with the latent as input."""
    hidden: HiddenLayers = (512, 256, 128)
    """Hidden layers behind the encoder (paper Table I) with `start: anew`; otherwise they are the teacher's."""
    activation: Literal["elu", "relu", "tanh"] = "elu"
    """Activation of encoder and hidden layers with `start: anew`; otherwise they have the teacher's."""
    learning_rate: float = Field(default=5e-4, gt=0)
    """Initial learning rate of Adam; a cosine schedule reduces it to a tenth."""
    gradient_norm: float = Field(default=1.0, gt=0)
    """Largest gradient norm; larger gradients are clipped."""
    batch: int = Field(default=1024, ge=1, le=10_000_000)
    """Batch size of a gradient step; samples are drawn from the whole buffer."""
    gradient_steps: int = Field(default=12, ge=1, le=100_000)
    """Gradient steps of one round."""
    buffer: int = Field(default=300_000, ge=1, le=100_000_000)
    """Capacity of the replay buffer [samples]; the newest are kept."""
    teacher_share: float = Field(default=0.1, ge=0, le=1)
    """Initial fraction of training in which the teacher still acts in some environments. Their number falls linearly
    from all to none."""
    withheld: tuple[str, ...] = Field(default=(), json_schema_extra=LATER)
    """Names of the parts of s_priv that are masked with their training mean whenever the teacher acts or labels. The
    student cannot react to quantities that no history shows, such as a motor's strength, and the teacher acts better
    without them."""
    observe_object: bool = Field(default=True, json_schema_extra=LATER)
    """Include the object in the student's observation if the teacher observes it (`task.observation.observe_object`).
    If false, the student has proprioception only (paper III-C.2) and infers the object's pose from its history, as it
    infers s_priv."""
    std: Literal["learnt", "shared"] = "learnt"
    """Standard deviation of the student's Gaussian. `learnt`: its own, trained with the KL divergence (paper eq. 7).
    `shared`: the teacher's; the loss is then a squared error scaled by it."""
    std_floor: float = Field(default=0.1, gt=0)
    """Smallest standard deviation of both Gaussians in the KL divergence [action units]; bounds the error's weight."""
    auxiliary: float = Field(default=0.1, ge=0)
    """Weight of an auxiliary loss: the mean squared error with which the latent predicts the object's mass and the
    base's velocity, each normalized by its standard deviation. 0 disables it."""
    seed: int | None = Field(default=None, ge=0, lt=2**32, json_schema_extra=LATER)
    """Seed of this training; empty: the recipe's `seed`."""
    checkpoint_every: int = Field(default=50, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Rounds between two checkpoints."""

    def problems(self) -> Problems:
        if self.batch > self.buffer:
            yield "", f"batch ({self.batch}) is larger than buffer ({self.buffer})"
