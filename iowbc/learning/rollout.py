"""Training samples of a rollout, each a row of float32 numbers."""

import torch
from torch import Tensor

from iowbc.arrays import Array, Mask, places
from iowbc.learning.advantages import advantages

SINGLE = ("log_density", "value", "advantage", "target")
"""Scalar columns."""


class Samples:
    """Samples of T steps of n environments as rows, so that an epoch shuffles them with a single gather.

    `columns` are views of the rows by name: prepared observation, action, the policy's mean, log density and
    value before the update, advantage and value target. Each rollout overwrites the previous one.
    """

    def __init__(
        self, steps: int, environments: int, observation: int, actions: int, device: torch.device | None = None
    ) -> None:
        acting = dict.fromkeys(("action", "mean"), actions)
        sizes = {"observation": observation, **acting, **dict.fromkeys(SINGLE, 1)}
        self.places = places(sizes)
        self.rows = torch.zeros(steps, environments, sum(sizes.values()), device=device)
        self.columns = self.named(self.rows)

    def named(self, rows: Tensor) -> dict[str, Tensor]:
        """Views of rows (..., width) by column name; scalar columns drop the last axis."""
        views = {name: rows[..., place] for name, place in self.places.items()}
        return {name: view[..., 0] if name in SINGLE else view for name, view in views.items()}

    @property
    def flat(self) -> Tensor:
        """All samples, (T·n, width)."""
        return self.rows.view(-1, self.rows.shape[-1])

    def finish(self, rewards: Array, ended: Mask, last_value: Array, discount: float, decay: float) -> None:
        """Add advantages and targets; arguments as in `advantages`."""
        values = self.columns["value"].cpu().numpy()
        found = advantages(rewards, ended, values, last_value, discount, decay)
        self.columns["advantage"].copy_(torch.from_numpy(found))
        self.columns["target"].copy_(torch.from_numpy(found + values))
