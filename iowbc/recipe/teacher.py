"""PPO with privileged information (paper section III-C, Table I)."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, NonNegativeFloat, PositiveFloat

from iowbc.recipe.evaluation.sequences import DrawnScripts, Segment
from iowbc.recipe.ppo import PPO
from iowbc.recipe.section import COSMETIC, DEEPEST, LATER, ArtifactName, Encoder, Section, Width, in_order
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
    """A few trials, always the same, played with the policy's mean action every so often."""

    every: int | None = Field(default=50, ge=1)
    """Updates between two checks; a check takes about as long as one update. Empty never checks: the last policy is
    kept, whatever became of it."""
    lifting: tuple[NonNegativeFloat, ...] = (0.0, 4.0, 8.0)
    """Masses in the scene `lift` [kg], where the task plays it; 0 is the scene without an object."""
    pushing: tuple[NonNegativeFloat, ...] = (30.0,)
    """Masses in the scene `push` [kg], where the task plays it."""
    others: dict[ObjectScene, tuple[NonNegativeFloat, ...]] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses in other scenes [kg], a recipe's own too, where the task plays them."""
    trials: int = Field(default=2, ge=1, le=1000)
    """Trials at each mass."""
    seed: int = Field(default=5000, ge=0, lt=2**32)
    """Seed of the first trial: apart from those of training and export; those of the tables are of another split
    (`eval.split`)."""
    films: int = Field(default=0, ge=0, le=100, json_schema_extra=COSMETIC)
    """Films of a trial of a middling load, one each time a further such part of the training is done; each takes some
    15 s without a graphics card. 0 makes none."""
    sequence: tuple[Segment, ...] = STAND_WALK_TURN
    """Commands of a trial, in order; empty takes `scripts`, or without any the fixed sequences of lifting and of
    pushing."""
    scripts: DrawnScripts | None = Field(default=None, json_schema_extra=LATER)
    """Scripts drawn trial by trial, where `sequence` is empty: a policy is then not chosen by one script."""
    scales: Errors = Field(default=IO_WBC_UNLOADED, json_schema_extra=LATER)
    """Errors E_α [rad], E_h [m], E_v [m/s] and E_ψ [rad] that halve their part of the score; by default the paper's
    IO-WBC without a load (Table II). An error that is far below its scale counts little."""
    fall: float = Field(default=1.0, ge=0, le=1, json_schema_extra=LATER)
    """Factor on the score of a trial that is not survived. At 1 who falls in the last second of twenty
    loses a twentieth, less than what walking a little nearer to the velocity brings."""
    collapse: float = Field(default=1 / 3, gt=0, lt=1)
    """Part of the best score whose loss counts as a collapse: the training goes back to its best policy."""
    notable: float = Field(default=0.4, ge=0, lt=1)
    """Best score from which a fall of it can be a collapse. Below, scores are mostly chance, and fall while a policy
    that stood learns to walk."""
    patience: int = Field(default=3, ge=1)
    """Checks in a row that must say so: one of eight trials more or less moves the score by a tenth."""
    caution: float = Field(default=0.5, gt=0, lt=1)
    """Factor on the desired KL divergence and the learning rate after each collapse."""
    rollbacks: int = Field(default=6, ge=0, le=1000)
    """Collapses without a better policy between them after which the stage gives up."""


LARGEST_UPDATE = 10_000_000
"""Samples that are kept in memory for one update."""


class HistoryNetwork(Encoder):
    """The student's network as PPO trains it, without a teacher (the paper's "w/o distillation")."""

    length: int = Field(default=25, ge=2, le=1000)
    """Length of the observation history H_t (paper Table I)."""
    estimate: bool = Field(default=False, json_schema_extra=LATER)
    """Lets the body see an estimate of s_priv from the latent, and not the latent, as a student does that is distilled
    with `distill.start: teacher`."""
    student: ArtifactName | None = Field(default=None, json_schema_extra=COSMETIC)
    """A distilled student to begin from, as `teacher.start` names a teacher: that recipe's student goes on learning
    from the reward. A student imitates its teacher, also where the history does not tell what its teacher knows; PPO
    finds what to do there. Its network must be this one (`estimate` included)."""


class Restart(Section):
    """A warm restart: the standard deviation is raised once and decays again, so that a policy that hardly explores can
    learn new conditions."""

    after: int = Field(default=0, ge=0, le=10**12)
    """Environment steps after which it comes; at 0 before the first, for a training that begins from a trained one
    (`teacher.start`)."""
    std: float = Field(default=0.3, gt=0)
    """Standard deviation set at the restart; at 0.3 a trained policy still walks, and updates may be twice as large at
    the same KL divergence."""
    half_life: int = Field(default=4_000_000, ge=1)
    """Environment steps in which the largest standard deviation halves from there on, down to `std_end`."""


class Teacher(PPO):
    """PPO with privileged information."""

    steps: int = Field(default=30_000_000, ge=1, le=10**12)
    """Environment steps of the whole training, summed over the environments. Nothing in it depends on this number but
    where it ends: a training that differs only by a greater one goes on from the finished one."""
    environments: int = Field(default=96, ge=1, le=100_000)
    """Parallel environments (paper: 2048). Few environments with many updates learn from fewer samples."""
    rollout: int = Field(default=48, ge=2, le=10_000)
    """Control steps that each environment contributes to one update."""
    hidden: tuple[Width, ...] = Field(default=(512, 256, 128), max_length=DEEPEST)
    """Hidden layers of policy and value network (paper Table I)."""
    learning_rate: float = Field(default=2e-4, gt=0)
    """Adam's learning rate at the start (paper Table I)."""
    desired_kl: float | None = Field(default=0.016, gt=0)
    """KL divergence of the old policy from the new one that an update should have, in closed form: the learning rate
    falls by a fifth beyond one and a half times as much, and rises by a fifth below two thirds. At 0.016 a sixth of the
    samples is clipped; at 0.04 a third was, and training was slower. Empty keeps the learning rate constant."""
    learning_rate_range: Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(in_order)] = (2e-5, 1e-3)
    """Least and largest learning rate, where `desired_kl` moves it."""
    gamma: float = Field(default=0.99, gt=0, lt=1)
    """Discount factor (paper Table I)."""
    smoothness: float = Field(default=0.0, ge=0, json_schema_extra=LATER)
    """Weight of the KL divergence between the policy and its mean one step before and after: a cost of the action's
    squared second difference. A reward for smoothness sees the exploration as well, whose jitter outweighs the policy's
    own; this term does not (temporal smoothness of CAPS, Mysore et al. 2021)."""
    value_weight: float = Field(default=0.5, ge=0)
    """Weight of the value loss."""
    initial_std: float = Field(default=0.5, gt=0)
    """Initial standard deviation of the action, in units of the action (before the action scale); 0.3 learnt slower."""
    std_learning_rate: float = Field(default=1.5e-4, gt=0)
    """Adam's learning rate of the standard deviation. At 5e-4 the deviation fell to 0.30 in 2.3 million steps, before
    walking; at the networks' rate it stayed, and its noise felled a third of the standing episodes."""
    std_half_life: int | None = Field(default=10_000_000, ge=1)
    """Environment steps in which the largest standard deviation halves, from the initial one down to `std_end`:
    exploration shrinks even where the gradient does not ask for it. Empty sets no such bound."""
    std_end: float = Field(default=0.2, gt=0)
    """Value at which the largest standard deviation comes to rest."""
    restart: Restart | None = Field(default=None, json_schema_extra=LATER)
    """Brings exploration back once; see `Restart`. Empty lets it shrink for good."""
    average_half_life: int | None = Field(default=None, ge=1, le=10**12, json_schema_extra=LATER)
    """Environment steps in which the weight of a policy halves in a running mean of all of them. With it that mean is
    what checks score and the stage leaves: the newest policy has also learnt what the last rollouts happened to hold.
    Empty takes the newest."""
    symmetry: Literal["construction", "augment", "none"] = "construction"
    """Use of the left-right symmetry of robot and task. `construction`: the networks commute with the mirror,
    exactly, with half the multiplications. `augment`: dense networks that also see mirror images of their samples.
    `none`: early learning takes twice the steps."""
    mirror_gap: float = Field(default=3.0, gt=0)
    """With `augment`: a mirror image that is less likely than its sample by more than this [nat] is not shown, for its
    probability ratio explodes."""
    normalization_clip: float = Field(default=10.0, gt=0)
    """Normalised observations are clipped to this many standard deviations."""
    statistics_until: int = Field(default=10_000_000, ge=1, le=10**12)
    """Environment steps after which the statistics that normalise observations and rewards are kept as they are: late
    in training they move by less than a percent, and each move shifts what the policy has learnt."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """Numbers in which the hidden layers learn. `auto`: bfloat16 where the processor multiplies in it (avx512_bf16,
    amx), which is up to twice as fast; rollouts, values and the last layers are float32 in any case. Rounding alone is
    a divergence of 0.0014 at a std of 0.15, and grows as that shrinks: with a `desired_kl` below 0.01 take float32."""
    parts: int = Field(default=2, ge=1, le=1000)
    """Parts of a minibatch that cores work on side by side while the environments rest; where there are fewer cores,
    one after another, with the same result."""
    check: Check = Check()
    """A small fixed evaluation that keeps the best policy and brings a lost training back to it."""
    value_only: tuple[str, ...] = Field(default=(), json_schema_extra=LATER)
    """Parts of s_priv, by name, that the value network receives and the policy does not. A policy overfits to
    quantities that are drawn once an episode: given the means of 58 motor strengths and encoder biases in their place,
    it survived more trials and kept closer to the command."""
    history: HistoryNetwork | None = Field(default=None, json_schema_extra=LATER)
    """With it the policy sees H_t alone and not s_priv: it is the student's network, needs no distillation, and can be
    exported. The value network, which nobody deploys, sees the newest s_t and s_priv as ever. `hidden` and `activation`
    are those behind the encoder."""
    seed: int | None = Field(default=None, ge=0, lt=2**32, json_schema_extra=LATER)
    """Seed of this training alone; the recipe's `seed` when empty. With another one here and in `distill`, a recipe is
    a second training of the same controller, on the same reference generator."""
    start: ArtifactName | None = Field(default=None, json_schema_extra=COSMETIC)
    """A trained teacher to begin from: that of another recipe, whose file is named as in `extends` and which runs
    first where it has not, or a stored one by eight or more first characters of its key, in quotes (`iowbc ls`). Its
    policy, the statistics of what that observes, and its curriculum are where this training begins, which counts its
    steps from zero. One thing changed can so be tried in a tenth of the time. What it began from is part of the key,
    not what it was called."""
    value_first: int = Field(default=300_000, ge=0, le=10**12, json_schema_extra=LATER)
    """With `start`: first environment steps, in which only the value network learns, for the loaded policy, world and
    reward. After 250 thousand it explains nine tenths of the variance; a policy updated earlier loses skills."""
    checkpoint_every: int = Field(default=20, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Updates between two checkpoints."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if not self.std_floor < self.std_end <= self.initial_std:
            stds = f"{self.std_floor:g}, {self.std_end:g}, {self.initial_std:g}"
            yield "", f"std_floor, std_end and initial_std must ascend, got {stds}"
        if self.restart is not None and self.restart.std < self.std_end:
            yield "", f"restart.std {self.restart.std:g} is below std_end {self.std_end:g}: nothing comes back"
        if self.history is not None and self.symmetry == "augment":
            yield "", "symmetry: with `history` it is `construction` or `none`, not `augment`"
        if self.start is not None and self.history is not None and self.history.student is not None:
            yield "", "history.student: `start` names a policy to begin from, too; give one of them"
        latent = () if self.history is None else (self.history.latent,)
        unpaired = [units for units in (*latent, *self.hidden) if units % 2]
        if self.symmetry == "construction" and unpaired:
            yield "", f"the mirror swaps units of a layer in pairs; {unpaired[0]} is odd, give an even number"
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
