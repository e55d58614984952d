"""On-policy distillation (DAgger) of the teacher into a student that sees only its history (paper eq. 7).

The student acts, and the teacher labels its states with target actions.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from iowbc.learning import checkpoint
from iowbc.learning.as_numpy import numpy_policy, student_policy
from iowbc.learning.checkpoint import Arrays
from iowbc.learning.environments import Environments
from iowbc.learning.gaussian import divergence, std_places
from iowbc.learning.networks import StudentNetwork, TeacherNetwork, mirror_as_json, mirrors_as_json, perceptron, swap
from iowbc.learning.storage import Network
from iowbc.recipe.distillation import Distillation
from iowbc.robot.mirror import MirrorMap
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.policies import History
from iowbc.rollouts.rollout_policies import DaggerPolicy, Past

Symmetry = Literal["construction", "none"]


def spread(environments: int) -> NDArray[np.float64]:
    """Low-discrepancy numbers in [0, 1), shape (n,): multiples of the golden ratio, modulo 1.

    The teacher controls the environments whose number is below its share. Neighbouring environments have the same
    scene, and any run of neighbours covers [0, 1) evenly; so the teacher's share is the same in every scene.
    """
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    return np.array([index * golden % 1.0 for index in range(environments)])


class ReplayBuffer:
    """Ring buffer of the newest control steps of n environments: s_t, target and age of the episode in steps.

    A sample is the student's history H_t, rebuilt from the buffer, and its target: the teacher's action and any further
    regression targets.
    """

    def __init__(self, capacity: int, environments: int, observation: int, targets: int, history: int) -> None:
        self.steps = max(capacity // environments, history)
        self.history = history
        self.observations = np.zeros((self.steps, environments, observation), np.float32)
        self.targets = np.zeros((self.steps, environments, targets), np.float32)
        self.ages = np.zeros((self.steps, environments), np.int64)
        self.added = 0

    def add(self, observation: NDArray[np.float32], target: NDArray[np.float32], starts: NDArray[np.bool_]) -> None:
        """Append a control step: s_t, shape (n, S), the target, shape (n, T), and where an episode starts."""
        slot, last = self.added % self.steps, (self.added - 1) % self.steps
        self.observations[slot] = observation
        self.targets[slot] = target
        self.ages[slot] = np.where(starts, 0, self.ages[last] + 1)
        self.added += 1

    def sample(self, batch: int, random: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Histories, shape (batch, K, S), and targets, shape (batch, T), drawn uniformly."""
        oldest = 0 if self.added <= self.steps else self.added - self.steps + self.history - 1
        times = random.integers(oldest, self.added, batch)
        environments = random.integers(0, self.observations.shape[1], batch)
        back = np.arange(self.history - 1, -1, -1)
        ages = self.ages[times % self.steps, environments]
        moments = times[:, None] - np.minimum(back[None], ages[:, None])
        frames = self.observations[moments % self.steps, environments[:, None]]
        return frames, self.targets[times % self.steps, environments]

    def arrays(self) -> Arrays:
        """State for a checkpoint."""
        return {
            "observations": self.observations,
            "targets": self.targets,
            "ages": self.ages,
            "added": np.array([self.added]),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`."""
        self.observations[:] = arrays["observations"]
        self.targets[:] = arrays["targets"]
        self.ages[:] = arrays["ages"]
        self.added = int(arrays["added"][0])


class DistillationLoss(nn.Module):
    """KL(teacher || student) (paper eq. 7) and the auxiliary error of facts predicted from the latent, with all trained
    modules: the network, its standard deviation and the auxiliary head."""

    teacher_log_std: Tensor
    std_place: Tensor

    def __init__(
        self,
        settings: Distillation,
        teacher_log_std: Tensor,
        network: StudentNetwork,
        facts_mirror: MirrorMap,
        action_mirror: MirrorMap,
        symmetry: Symmetry,
    ) -> None:
        """`teacher_log_std`: not below the recipe's floor, (A,); mirrors: of the auxiliary targets (facts) and of the
        action."""
        super().__init__()
        self.settings, self.network = settings, network
        self.register_buffer("teacher_log_std", teacher_log_std.clone())
        self.actions, facts = len(teacher_log_std), len(facts_mirror)
        symmetric = symmetry == "construction"
        place = std_places(self.actions, action_mirror if symmetric else None)
        kinds = np.unique(place, return_index=True)[1]
        self.register_buffer("std_place", torch.from_numpy(place), persistent=False)
        self.log_stds = nn.Parameter(teacher_log_std[kinds].clone(), requires_grad=settings.std == "learnt")
        """One per pair of actions that the mirror swaps, and one per remaining action."""
        both = (swap(settings.latent // 2), facts_mirror) if symmetric else None
        self.reader = perceptron(settings.latent, (settings.latent,), facts, settings.activation, both)

    @property
    def log_std(self) -> Tensor:
        """Logarithm of the student's standard deviation, (A,), not below the floor."""
        return self.log_stds[self.std_place].clamp(min=float(np.log(self.settings.std_floor)))

    def forward(self, histories: Tensor, answers: Tensor) -> tuple[Tensor, dict[str, float]]:
        """Loss and its parts. Histories, (n, K, S); answers: the teacher's actions and the facts, (n, A + facts)."""
        target, facts = answers[:, : self.actions], answers[:, self.actions :]
        newest, latent = self.network.read(histories)
        mean = self.network.act(newest, latent)
        loss = kl = divergence(target, self.teacher_log_std, mean, self.log_std).mean()
        figures = {"kl" if self.settings.std == "learnt" else "kl_at_shared_std": float(kl.detach())}
        if self.settings.auxiliary:
            read = nn.functional.mse_loss(self.reader(latent), facts)
            loss = loss + self.settings.auxiliary * read
            figures["auxiliary_error"] = float(read.detach())
        return loss, figures


@dataclass(frozen=True)
class Rows:
    """Layout of an observation row of the environments, and mirrors of its parts."""

    observation: slice
    """The student's part of s_t, at the start of the row."""
    privileged: slice
    """The teacher's part: the rest of s_t, and s_priv."""
    facts: NDArray[np.int64]
    """Indices of the auxiliary targets, which are predicted from the latent."""
    withheld: NDArray[np.int64]
    """Indices in `privileged` that are masked from the teacher."""
    observation_mirror: MirrorMap
    privileged_mirror: MirrorMap
    facts_mirror: MirrorMap
    action_mirror: MirrorMap


class StudentTraining:
    """On-policy distillation. Between two rounds, `arrays` is its complete state."""

    def __init__(
        self,
        settings: Distillation,
        environments: Environments,
        teachers: Sequence[Network],
        teacher_of: NDArray[np.int64],
        architecture: Mapping[str, Any],
        rows: Rows,
        symmetry: Symmetry,
        seed: int,
    ) -> None:
        """`teacher_of`: index of each environment's teacher, (n,); `architecture`: arguments that rebuild the first
        teacher; `symmetry`: of the teachers. The student takes over the first teacher's normalisation and, if
        `settings.start` is "teacher", its body, or the whole network of a teacher that is a student itself."""
        torch.manual_seed(seed)
        self.settings, self.environments, self.rows = settings, environments, rows
        self.teachers, self.teacher_of = tuple(map(numpy_policy, teachers)), teacher_of
        teacher = teachers[0]
        size, actions = rows.observation.stop, environments.action_space.shape[0]
        inherits = settings.start == "teacher"
        self.architecture: dict[str, Any] = {
            "observation": size,
            "history": settings.history,
            "actions": actions,
            "frame_features": settings.frame_features,
            "latent": settings.latent,
            "hidden": list(architecture["hidden"] if inherits else settings.hidden),
            "activation": architecture["activation"] if inherits else settings.activation,
            "clip": teacher.normalizer.clip,
            "encoder": settings.encoder,
            "mirrors": mirrors_as_json((rows.observation_mirror, rows.action_mirror), symmetry),
            "privileged": mirror_as_json(rows.privileged_mirror) if inherits else None,
        }
        if inherits and isinstance(teacher, StudentNetwork):
            self.architecture = dict(architecture)
        self.network = StudentNetwork(**self.architecture)
        if inherits and isinstance(teacher, StudentNetwork):
            self.network.load_state_dict(teacher.state_dict())
        elif inherits:
            self.network.body.load_state_dict(teacher.body.state_dict())
        self.network.normalizer.mean.copy_(teacher.normalizer.mean[rows.observation])
        self.network.normalizer.std.copy_(teacher.normalizer.std[rows.observation])
        floor = float(np.log(settings.std_floor))
        log_std = torch.stack([one.log_std for one in teachers]).mean(0).clamp(min=floor)
        self.loss = DistillationLoss(settings, log_std, self.network, rows.facts_mirror, rows.action_mirror, symmetry)
        knowing = next((one.normalizer for one in teachers if isinstance(one, TeacherNetwork)), None)
        self.facts_mean = torch.zeros(len(rows.facts)) if knowing is None else knowing.mean[rows.facts]
        self.facts_std = torch.ones(len(rows.facts)) if knowing is None else knowing.std[rows.facts]
        self.optimizer = torch.optim.Adam(self.loss.parameters(), settings.learning_rate)
        self.random = np.random.default_rng(seed)
        self.experience = ReplayBuffer(
            settings.buffer, settings.environments, size, actions + len(rows.facts), settings.history
        )
        self.history = History(settings.environments, settings.history, size)
        self.starts = np.ones(settings.environments, np.bool_)
        self.observation: NDArray[np.float32] | None = None
        self.teacher_drives = spread(settings.environments)
        self._steps_a_round = settings.environments * settings.rollout
        self.rounds, self._planned_rounds = 0, -(-settings.steps // self._steps_a_round)
        self.planned = self._planned_rounds * self._steps_a_round
        """Environment steps of the whole training, rounded up to whole rounds."""

    @property
    def steps(self) -> int:
        """Environment steps made so far."""
        return self.rounds * self._steps_a_round

    def update(self) -> dict[str, float]:
        """One round: a rollout and its gradient steps; returns the statistics of both."""
        settings, progress = self.settings, self.rounds / self._planned_rounds
        share = max(0.0, 1.0 - progress / settings.teacher_share) if settings.teacher_share else 0.0
        error, target_square = self._rollout(share)
        for group in self.optimizer.param_groups:
            group["lr"] = settings.learning_rate * (0.1 + 0.9 * 0.5 * (1 + np.cos(np.pi * progress)))
        figures = [self._gradient_step() for _ in range(settings.gradient_steps)]
        self.rounds += 1
        self.network.log_std.copy_(self.loss.log_std.detach())
        return {
            **{name: float(np.mean([found[name] for found in figures])) for name in figures[0]},
            "std": float(self.network.log_std.exp().mean()),
            "action_rmse": float(np.sqrt(error)),
            "action_agreement": float(1 - error / target_square),
            "teacher_share": share,
            **self.environments.statistics(),
        }

    def _rollout(self, teacher_share: float) -> tuple[np.floating[Any], np.floating[Any]]:
        """Rollout in which the teacher acts in its share of environments, the student in the others; returns the mean
        squares of the student's error and of the teacher's action."""
        rows, history = self.rows, self.history
        if self.observation is None:
            self.observation = self.environments.reset()
        rollout_policy = DaggerPolicy(
            student=student_policy(self.network),
            teachers=self.teachers,
            teacher_of=self.teacher_of,
            observation=rows.observation,
            privileged=rows.privileged,
            masked=rows.privileged.start + rows.withheld,
            taught=self.teacher_drives < teacher_share,
            block=block_size(len(self.starts)),
            past=Past(history.frames, self.starts),
        )
        found = self.environments.roll(rollout_policy, self.settings.rollout)
        facts = (found.observation[:-1][..., rows.facts] - self.facts_mean.numpy()) / self.facts_std.numpy()
        facts = facts.clip(-self.network.normalizer.clip, self.network.normalizer.clip)
        frames, targets = found.observation[:-1, :, rows.observation], found.records["answer"]
        for frame, target, fact, ended in zip(frames, targets, facts, found.ended, strict=True):
            self.experience.add(frame, np.concatenate([target, fact], axis=1), self.starts)
            history.push(frame, self.starts)
            self.starts = ended
        self.observation = found.observation[-1]
        return np.mean((found.records["own"] - targets) ** 2), np.mean(targets**2)

    def _gradient_step(self) -> dict[str, float]:
        """One optimiser step with clipped gradient; returns the statistics of the loss before it."""
        histories, answers = self.experience.sample(self.settings.batch, self.random)
        loss, figures = self.loss(torch.from_numpy(histories), torch.from_numpy(answers))
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.loss.parameters(), self.settings.gradient_norm)
        self.optimizer.step()
        return figures

    def arrays(self) -> Arrays:
        """Complete state between two rounds, for a checkpoint."""
        assert self.observation is not None
        return {
            **checkpoint.prefixed("student", checkpoint.module_arrays(self.loss)),
            **checkpoint.prefixed("optimizer", checkpoint.optimizer_arrays(self.optimizer)),
            **checkpoint.prefixed("experience", self.experience.arrays()),
            **checkpoint.prefixed("environment", self.environments.state()),
            "history": self.history.frames,
            "starts": self.starts,
            "observation": self.observation,
            "rounds": np.array([self.rounds]),
            "random": np.frombuffer(json.dumps(self.random.bit_generator.state).encode(), np.uint8),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`, for a training with the same recipe."""
        checkpoint.restore_module(self.loss, checkpoint.under("student", arrays))
        checkpoint.restore_optimizer(self.optimizer, checkpoint.under("optimizer", arrays))
        self.experience.restore(checkpoint.under("experience", arrays))
        self.environments.restore(checkpoint.under("environment", arrays))
        self.history.frames[:], self.starts[:] = arrays["history"], arrays["starts"]
        self.observation = np.array(arrays["observation"])
        self.rounds = int(arrays["rounds"][0])
        self.random.bit_generator.state = json.loads(arrays["random"].tobytes())
