"""PPO with privileged information (paper section III-C, Table I)."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from iowbc.recipe.evaluation.sequences import DrawnScripts, Segment
from iowbc.recipe.ppo import PPO
from iowbc.recipe.section import COSMETIC, LATER, ArtifactName, Encoder, HiddenLayers, PositiveRange, Problems, Section
from iowbc.recipe.simulation.holding import ObjectScene

STAND_WALK_TURN = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=3.0, velocity=(0.4, 0.0, 0.0)),
    Segment(duration=2.0, velocity=(0.3, 0.0, 0.3)),
    Segment(duration=2.0, height=0.66, pitch=0.2, ramp=0.8),
    Segment(duration=2.0, ramp=0.5),
)
"""Stand, walk, turn, crouch and lean, stand: 10 s."""
Errors = tuple[PositiveFloat, PositiveFloat, PositiveFloat, PositiveFloat]
IO_WBC_UNLOADED = (0.125, 0.015, 0.046, 0.134)


class Check(Section):
    """Validation during training: a fixed set of trials with the policy's mean action, at regular intervals."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"films": 0}

    every: int | None = Field(default=50, ge=1)
    """Updates between two checks; a check takes about as long as one update. Empty: no checks; the stage keeps the last
    policy, even if training has collapsed."""
    lifting: tuple[NonNegativeFloat, ...] = (0.0, 4.0, 8.0)
    """Masses in the scene `lift` [kg], if the task includes it; 0 is the scene without an object."""
    pushing: tuple[NonNegativeFloat, ...] = (30.0,)
    """Masses in the scene `push` [kg], if the task includes it."""
    others: dict[ObjectScene, tuple[NonNegativeFloat, ...]] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses in other scenes [kg], including custom ones, if the task includes them."""
    trials: int = Field(default=2, ge=1, le=1000)
    """Trials at each mass."""
    seed: int = Field(default=5000, ge=0, lt=2**32)
    """Seed of the first trial; distinct from those of training and export. Reported results have another
    `eval.split`."""
    sequence: tuple[Segment, ...] = STAND_WALK_TURN
    """Command sequence of a trial; empty: `scripts`, or else the fixed sequences of lifting and pushing."""
    scripts: DrawnScripts | None = Field(default=None, json_schema_extra=LATER)
    """Random command scripts, drawn per trial, if `sequence` is empty; selection then depends on more than one
    script."""
    scales: Errors = Field(default=IO_WBC_UNLOADED, json_schema_extra=LATER)
    """Errors E_α [rad], E_h [m], E_v [m/s] and E_ψ [rad] that halve their part of the score; by default the paper's
    IO-WBC without a load (Table II). Errors far below their scale have little effect."""
    fall: float = Field(default=1.0, ge=0, le=1, json_schema_extra=LATER)
    """Factor on the score of a trial that is not survived. At 1 a fall in the last of twenty seconds costs a twentieth,
    less than slightly better velocity tracking gains."""
    collapse: float = Field(default=1 / 3, gt=0, lt=1)
    """Relative loss of the best score that counts as a collapse; training then returns to the best policy."""
    notable: float = Field(default=0.4, ge=0, lt=1)
    """Smallest best score for a collapse to be detected. Below it, scores are mostly noise, and fall while a standing
    policy learns to walk."""
    patience: int = Field(default=3, ge=1)
    """Consecutive checks that must show the loss: one trial of eight changes the score by a tenth."""
    caution: float = Field(default=0.5, gt=0, lt=1)
    """Factor on the desired KL divergence and the learning rate after each collapse."""
    rollbacks: int = Field(default=6, ge=0, le=1000)
    """Collapses without a new best policy in between after which the stage fails."""


LEAST_IN_GROUPS = 32
"""Fewest environments with groups: one worker process then steps a whole group (`iowbc.rollouts.blocks`)."""
LARGEST_UPDATE = 10_000_000
"""Largest number of samples of an update; they are kept in memory."""


class HistoryNetwork(Encoder):
    """The student's network trained by PPO directly, without a teacher (the paper's "w/o distillation")."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"experts": {}, "imitation": 0.1}

    length: int = Field(default=25, ge=2, le=1000)
    """Length of the observation history H_t (paper Table I)."""
    estimate: bool = Field(default=False, json_schema_extra=LATER)
    """Feed the layers behind the encoder an estimate of s_priv from the latent instead of the latent, as in a student
    distilled with `distill.start: teacher`."""
    student: ArtifactName | None = Field(default=None, json_schema_extra=COSMETIC)
    """Distilled student to fine-tune with PPO, named as in `teacher.start`. Distillation imitates the teacher even if
    the history lacks the teacher's information; PPO optimizes the reward there. The student must have this network
    (`estimate` included)."""


class Restart(Section):
    """A warm restart: the standard deviation is raised once and decays again, so that a policy that hardly explores can
    learn new conditions."""

    after: int = Field(default=0, ge=0, le=10**12)
    """Environment steps before the restart; 0: at the start, for a training that begins from a trained policy
    (`teacher.start`)."""
    std: float = Field(default=0.3, gt=0)
    """Standard deviation set at the restart; at 0.3 a trained policy still walks, and updates may be twice as large at
    the same KL divergence."""
    half_life: int = Field(default=4_000_000, ge=1)
    """Half-life of the standard deviation's upper bound after the restart [environment steps], down to `std_end`."""


class Teacher(PPO):
    """PPO with privileged information."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"smoothness": 0.0}
    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {"mirror_gap": 3.0}

    steps: int = Field(default=30_000_000, ge=1, le=10**12)
    """Environment steps of the training, summed over the environments. No schedule depends on them: a recipe that only
    increases this number resumes from the finished training."""
    environments: int = Field(default=96, ge=1, le=100_000)
    """Parallel environments (paper: 2048). Few environments with many updates learn from fewer samples."""
    group: Literal[1, 2, 4] = Field(default=1, json_schema_extra=LATER)
    """Environments that begin each rollout in the same state, that of a random one of them, and meet the same random
    quantities. In groups of four, subtracting the mean advantage of the others removes four fifths of its variance, at
    the cost of fewer different states (docs/log/groups.md). 1: separate environments, as in the paper."""
    rollout: int = Field(default=48, ge=2, le=10_000)
    """Control steps that each environment contributes to one update."""
    hidden: HiddenLayers = Field(default=(512, 256, 128), min_length=1)
    """Hidden layers of policy and value network (paper Table I)."""
    learning_rate: float = Field(default=2e-4, gt=0)
    """Initial learning rate of Adam (paper Table I)."""
    desired_kl: float | None = Field(default=0.016, gt=0)
    """Target KL divergence of an update, between the old and the new policy, in closed form. The learning rate falls by
    a fifth above 1.5 times the target, and rises by a fifth below two thirds of it. At 0.016 a sixth of the samples is
    clipped; at 0.04 a third was, and training was slower. Empty: constant learning rate."""
    learning_rate_range: PositiveRange = (2e-5, 1e-3)
    """Smallest and largest learning rate with `desired_kl`."""
    gamma: float = Field(default=0.99, gt=0, lt=1)
    """Discount factor (paper Table I)."""
    value_weight: float = Field(default=0.5, ge=0)
    """Weight of the value loss."""
    initial_std: float = Field(default=0.5, gt=0)
    """Initial standard deviation of the action, in units of the action (before the action scale); 0.3 learnt slower."""
    std_learning_rate: float = Field(default=1.5e-4, gt=0)
    """Adam's learning rate for the standard deviation. At 5e-4 it fell to 0.30 in 2.3 million steps, before the robot
    walked; at the networks' rate it stayed constant, and its noise felled a third of the standing episodes."""
    std_half_life: int | None = Field(default=10_000_000, ge=1)
    """Half-life of the upper bound on the standard deviation [environment steps], from the initial value down to
    `std_end`. It reduces exploration even where the gradient does not. Empty: no such bound."""
    std_end: float = Field(default=0.2, gt=0)
    """Final upper bound on the standard deviation."""
    noise_correlation: float = Field(default=0.0, ge=0.0, lt=1.0, json_schema_extra=LATER)
    """Correlation of the exploration noise between consecutive steps, as of a first-order autoregressive process, while
    the densities of PPO remain those of independent noise. 0: independent, as in the paper."""
    restart: Restart | None = Field(default=None, json_schema_extra=LATER)
    """Warm restart of the exploration; empty: none."""
    average_half_life: int | None = Field(default=None, ge=1, le=10**12, json_schema_extra=LATER)
    """Half-life of an exponential moving average of the policy's weights [environment steps]. The average is then the
    policy that is checked and saved, since the newest policy also fits the noise of the last rollouts. Empty: no
    average."""
    symmetry: Literal["construction", "none"] = "construction"
    """Use of the left-right symmetry of robot and task. `construction`: exactly equivariant networks, with half the
    multiplications. `none`: dense networks; early learning takes twice the steps."""
    normalization_clip: float = Field(default=10.0, gt=0)
    """Bound to which normalized observations are clipped [standard deviations]."""
    statistics_until: int = Field(default=10_000_000, ge=1, le=10**12)
    """Environment steps after which the normalization statistics of observations and rewards are frozen. Late in
    training they change by less than a percent, and each change shifts the policy's inputs."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """Number format of the hidden layers in updates. `auto`: bfloat16 if the processor supports it (avx512_bf16, amx),
    which is up to twice as fast; rollouts, values and output layers are always float32. Rounding alone causes a KL
    divergence of 0.0014 at a std of 0.15, and more at a smaller std: use float32 with a `desired_kl` below 0.01."""
    parts: int = Field(default=2, ge=1, le=1000)
    """Parts of a minibatch that are computed in parallel during updates. With fewer cores they are computed one after
    another, with the same result."""
    check: Check = Check()
    """Regular validation that keeps the best policy and returns to it after a collapse."""
    value_only: tuple[str, ...] = Field(default=(), json_schema_extra=LATER)
    """Names of the parts of s_priv that only the value network receives. A policy overfits to quantities that are drawn
    once per episode: with 58 motor strengths and encoder biases replaced by their means, it survived more trials and
    tracked the command better."""
    history: HistoryNetwork | None = Field(default=None, json_schema_extra=LATER)
    """Train the student's network directly: the policy observes H_t without s_priv, needs no distillation, and can be
    exported. The value network, which is not deployed, still observes the newest s_t and s_priv. `hidden` and
    `activation` are those behind the encoder."""
    seed: int | None = Field(default=None, ge=0, lt=2**32, json_schema_extra=LATER)
    """Seed of this training; empty: the recipe's `seed`. Another seed here and in `distill` repeats the training of the
    same controller with the same reference generator."""
    start: ArtifactName | None = Field(default=None, json_schema_extra=COSMETIC)
    """Trained teacher to start from: another recipe, named as in `extends` and run first if necessary, or a stored
    artifact by the first characters (8 or more) of its key, in quotes (`iowbc ls`). Training starts from its policy,
    normalization statistics of observations, and curriculum, and counts steps from zero. A single change can thus be
    tested in a tenth of the time. The key depends on the teacher's content, not on this name."""
    value_first: int = Field(default=300_000, ge=0, le=10**12, json_schema_extra=LATER)
    """With `start`: initial environment steps in which only the value network learns. After 250 thousand it explains
    nine tenths of the variance; updating the policy earlier loses skills."""
    checkpoint_every: int = Field(default=20, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Updates between two checkpoints."""

    def problems(self) -> Problems:
        if not self.std_floor < self.std_end <= self.initial_std:
            stds = f"{self.std_floor:g}, {self.std_end:g}, {self.initial_std:g}"
            yield "", f"std_floor, std_end and initial_std must ascend, got {stds}"
        if self.restart is not None and self.restart.std < self.std_end:
            yield "", f"restart.std {self.restart.std:g} is below std_end {self.std_end:g}: nothing comes back"
        if self.start is not None and self.history is not None and self.history.student is not None:
            yield "", "history.student: `start` names a policy to begin from, too; give one of them"
        latent = () if self.history is None else (self.history.latent,)
        unpaired = [units for units in (*latent, *self.hidden) if units % 2]
        if self.symmetry == "construction" and unpaired:
            yield "", f"the mirror swaps units of a layer in pairs; {unpaired[0]} is odd, give an even number"
        if self.group > 1 and (self.environments < LEAST_IN_GROUPS or self.environments % self.group):
            wanted = f"a multiple of {self.group} environments, at least {LEAST_IN_GROUPS}"
            yield "", f"group: groups of {self.group} need {wanted}; there are {self.environments}"
        samples = self.environments * self.rollout
        if samples > LARGEST_UPDATE:
            yield "", f"environments x rollout = {samples}: an update takes {LARGEST_UPDATE} samples at most"
        elif samples % self.minibatches:
            yield "", f"minibatches: {self.minibatches} does not divide environments x rollout = {samples}"

    @property
    def beginning(self) -> tuple[str, str | None]:
        """Dotted path of the value that names the policy to begin from, and that value."""
        student = None if self.history is None else self.history.student
        return ("teacher.start", self.start) if student is None else ("teacher.history.student", student)
