"""s_priv as a student reads it from the latent of its history, in the teacher's own normalisation."""

from torch import Tensor, nn

from iowbc.learning.symmetric import SymmetricHead
from iowbc.robot.mirror import MirrorMap


class Estimate(nn.Module):
    """A linear map from the latent to s_priv that begins at the mean of training, zero."""

    def __init__(self, latent: int, size: int, mirror: MirrorMap | None) -> None:
        """`size`: of s_priv; `mirror`: its mirror, where that swaps the halves of the latent."""
        super().__init__()
        self.symmetric = mirror is not None
        self.head = nn.Linear(latent, size) if mirror is None else SymmetricHead(latent, mirror)
        for parameter in self.head.parameters():
            nn.init.zeros_(parameter)

    def forward(self, latent: Tensor) -> Tensor:
        estimate: Tensor
        if self.symmetric:
            own, image = latent.chunk(2, dim=-1)
            estimate = self.head(own + image, own - image)
        else:
            estimate = self.head(latent)
        return estimate
