"""Student loss: KL(teacher || student) (paper eq. 7) and the auxiliary error of facts predicted from the latent."""

from typing import Literal

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.learning.gaussian import divergence, std_places
from iowbc.learning.networks import StudentNetwork, perceptron, swap
from iowbc.recipe.distillation import Distillation
from iowbc.robot.mirror import MirrorMap

Symmetry = Literal["construction", "augment", "none"]


class DistillationLoss(nn.Module):
    """Student loss with all trained modules: the network, its standard deviation and the auxiliary head."""

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
