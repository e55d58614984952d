"""A decentralised policy in training: a network with its exploration, normalisation and optimiser."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.arrays import Array
from iowbc.learning import checkpoint
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.learning.networks import TeacherNetwork
from iowbc.learning.normalization import Normalization
from iowbc.learning.policy import HIDDEN_GAIN
from iowbc.recipe.skill.learning import SkillLearning


class Trained:
    """A network in training, with its optimiser and the running statistics of its inputs."""

    def __init__(self, inputs: int, outputs: int, settings: SkillLearning, gain: float, rate: float) -> None:
        """`gain`: of the output layer's orthogonal weights; 0 gives zero at the start. `rate`: Adam's learning rate."""
        self.architecture: dict[str, Any] = {
            "inputs": inputs,
            "actions": outputs,
            "hidden": list(settings.hidden),
            "activation": settings.activation,
            "clip": settings.normalization_clip,
        }
        self.network = TeacherNetwork(**self.architecture)
        self.network.body.initialize(HIDDEN_GAIN, gain)
        self.normalization = Normalization(inputs, settings.games, settings.gamma, None)
        self.rate, self.gradient_norm = rate, settings.gradient_norm
        self.log_std = nn.Parameter(torch.full((outputs,), float(np.log(settings.initial_std))))
        """Used by policies only."""
        self.parameters = [*self.network.body.parameters(), self.log_std]
        self.optimizer = torch.optim.Adam(self.parameters, lr=self.rate, eps=1e-5)

    def prepared(self, inputs: Array) -> Tensor:
        """Inputs (..., k), normalised."""
        with torch.inference_mode():
            return self.network.normalizer(torch.from_numpy(inputs))

    def descend(self, loss: Tensor) -> None:
        self.optimizer.param_groups[0]["lr"] = self.rate
        self.optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.parameters, self.gradient_norm)
        self.optimizer.step()

    def finished(self) -> TeacherNetwork:
        """The network with its standard deviation in it."""
        self.network.log_std.copy_(self.log_std.detach())
        return self.network

    def arrays(self) -> Arrays:
        return {
            **prefixed("network", checkpoint.module_arrays(self.finished())),
            **prefixed("optimizer", checkpoint.optimizer_arrays(self.optimizer)),
            **prefixed("normalization", self.normalization.arrays()),
            "rate": np.array([self.rate]),
        }

    def restore(self, arrays: Mapping[str, Array]) -> None:
        checkpoint.restore_module(self.network, under("network", arrays))
        with torch.no_grad():
            self.log_std.copy_(self.network.log_std)
        checkpoint.restore_optimizer(self.optimizer, under("optimizer", arrays))
        self.normalization.restore(under("normalization", arrays))
        self.rate = float(arrays["rate"][0])


def mean_actions(
    networks: Mapping[str, TeacherNetwork | None], observations: Mapping[str, Array], sizes: Mapping[str, int]
) -> dict[str, Array]:
    """Mean action of each agent's policy, (n, size), within its bounds; zero, the nominal action, without a policy."""
    with torch.inference_mode():
        return {
            agent: np.zeros((len(observations[agent]), sizes[agent]), np.float32)
            if network is None
            else network(torch.from_numpy(observations[agent])).clamp(-1.0, 1.0).numpy()
            for agent, network in networks.items()
        }
