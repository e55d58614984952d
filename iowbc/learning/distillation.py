"""On-policy distillation (DAgger) of the teacher into a student that sees only its history (paper eq. 7)."""

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from iowbc.learning.checkpoint import Arrays
from iowbc.learning.gaussian import divergence, std_places
from iowbc.learning.networks import StudentNetwork, perceptron, swap
from iowbc.recipe.distillation import Distillation
from iowbc.robot.mirror import MirrorMap

Symmetry = Literal["construction", "none"]
KEPT = ("observations", "targets", "ages")
"""Arrays of a replay buffer."""


def spread(environments: int) -> NDArray[np.float64]:
    """Low-discrepancy numbers in [0, 1), shape (n,): multiples of the golden ratio, modulo 1. The teacher controls the
    environments whose number is below its share. It is the same in every scene: neighbours have one scene, and any run
    of them covers [0, 1) evenly."""
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    return np.array([index * golden % 1.0 for index in range(environments)])


class ReplayBuffer:
    """Ring buffer of the newest control steps of n environments: s_t, target and age of the episode in steps.

    A sample is the student's history H_t, and its target: the teacher's action and any further regression targets.
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
        return {name: getattr(self, name) for name in KEPT} | {"added": np.array([self.added])}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        for name in KEPT:
            getattr(self, name)[:] = arrays[name]
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
        """`teacher_log_std`: not below the recipe's floor, (A,); `facts_mirror`: of the auxiliary targets."""
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
