"""Student training by DAgger: the student acts, the teacher labels its states with target actions."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from iowbc.learning import checkpoint
from iowbc.learning.as_numpy import numpy_policy, student_policy
from iowbc.learning.distillation import DistillationLoss, ReplayBuffer, Symmetry, spread
from iowbc.learning.environments import Environments
from iowbc.learning.networks import StudentNetwork, TeacherNetwork, mirror_as_json, mirrors_as_json
from iowbc.learning.storage import Network
from iowbc.recipe.distillation import Distillation
from iowbc.robot.mirror import MirrorMap
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.policies import History
from iowbc.rollouts.rollout import DaggerPolicy, Past


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

    def arrays(self) -> checkpoint.Arrays:
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
