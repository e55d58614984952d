"""The student's network and a privileged critic for PPO, on rows of a normalised H_t followed by s_priv."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from iowbc.learning.networks import Mirrors, Normalizer, StudentNetwork, mirror_as_json, mirrors_as_json
from iowbc.learning.perceptron import Hidden, Perceptron
from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap


def student_architecture(teacher: Teacher, observation: int, actions: int, mirrors: Mirrors) -> dict[str, Any]:
    """Arguments of a recipe's `StudentNetwork`; `mirrors`: of a row (s_t, s_priv) and of an action."""
    assert teacher.history is not None
    rows, action = mirrors
    sign = np.asarray(rows.sign)
    own = MirrorMap(rows.permutation[:observation], sign[:observation])
    privileged = MirrorMap(rows.permutation[observation:] - observation, sign[observation:])
    return {
        "observation": observation,
        "history": teacher.history.length,
        "actions": actions,
        "frame_features": teacher.history.frame_features,
        "latent": teacher.history.latent,
        "hidden": list(teacher.hidden),
        "activation": teacher.activation,
        "clip": teacher.normalization_clip,
        "encoder": teacher.history.encoder,
        "mirrors": mirrors_as_json((own, action), teacher.symmetry),
        "privileged": mirror_as_json(privileged) if teacher.history.estimate else None,
    }


class HistoryNormalizer(Normalizer):
    """Normalisation of rows (H_t, s_priv) by the statistics of (s_t, s_priv), equal for all steps of a history."""

    def __init__(self, size: int, clip: float, architecture: Mapping[str, Any]) -> None:
        """`size`: of (s_t, s_priv)."""
        super().__init__(size, clip)
        self.observation, self.length = int(architecture["observation"]), int(architecture["history"])

    def forward(self, x: Tensor) -> Tensor:
        places = torch.arange(len(self.mean))
        past = places[: self.observation].repeat(self.length - 1)
        every = torch.cat([past, places])
        return (x - self.mean[every]).div_(self.std[every]).clamp_(-self.clip, self.clip)

    def newest(self, rows: Any) -> Any:
        """Newest part (s_t, s_priv) of rows, shape (..., size)."""
        return rows[..., (self.length - 1) * self.observation :]


class HistoryActor(Perceptron):
    """The student's network without its input normalisation."""

    def __init__(self, architecture: Mapping[str, Any]) -> None:
        super().__init__()
        self.network = StudentNetwork(**architecture)
        self.length, self.observation = int(architecture["history"]), int(architecture["observation"])

    def hidden(self, prepared: Tensor) -> Hidden:
        flat = prepared.reshape(-1, prepared.shape[-1])
        frames = flat[:, : self.length * self.observation].reshape(-1, self.length, self.observation)
        context = self.network.body_context(self.network.encoder(frames))
        both = torch.cat([frames[:, -1], context], dim=1)
        parts = self.network.body.hidden(self.network.body.prepare(both))
        return tuple(part.reshape(*prepared.shape[:-1], -1) for part in parts)

    def head(self, hidden: Hidden) -> Tensor:
        return self.network.body.head(hidden)

    def initialize(self, gain: float, last: float) -> None:
        self.network.body.initialize(gain, last)


class NewestCritic(Perceptron):
    """Critic of (s_t, s_priv) alone: s_priv contains what the actor must infer from the history."""

    def __init__(self, critic: Perceptron, normalizer: HistoryNormalizer) -> None:
        super().__init__()
        self.critic = critic
        self._newest = normalizer.newest

    def hidden(self, prepared: Tensor) -> Hidden:
        return self.critic.hidden(self.critic.prepare(self._newest(prepared)))

    def head(self, hidden: Hidden) -> Tensor:
        return self.critic.head(hidden)

    def initialize(self, gain: float, last: float) -> None:
        self.critic.initialize(gain, last)
