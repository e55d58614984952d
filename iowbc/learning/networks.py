"""Networks of teacher and student, with their normalisation of observations and the student's encoder."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.learning.perceptron import ACTIVATIONS, DenseMlp, VectorPerceptron
from iowbc.learning.symmetric import SymmetricHead, SymmetricMlp, paired
from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap, side_by_side

Mirrors = tuple[MirrorMap, MirrorMap]
"""Mirror maps of an input and an output."""


def perceptron(
    inputs: int, hidden: Sequence[int], outputs: int, activation: str, mirrors: Mirrors | None
) -> VectorPerceptron:
    """Multilayer perceptron; if mirrors are given, it commutes with them."""
    if mirrors is None:
        return DenseMlp(inputs, hidden, outputs, activation)
    return SymmetricMlp(mirrors[0], hidden, mirrors[1], activation)


def mirror_as_json(mirror: MirrorMap) -> dict[str, list[float]]:
    """Mirror as JSON values; inverse of `mirror_from_json`."""
    return {"permutation": mirror.permutation.tolist(), "sign": np.asarray(mirror.sign).tolist()}


def mirrors_as_json(mirrors: Mirrors, symmetry: str) -> Any:
    """Both mirrors as JSON values if networks are symmetric by construction, else None."""
    return [mirror_as_json(mirror) for mirror in mirrors] if symmetry == "construction" else None


def mirror_from_json(plain: Any) -> MirrorMap:
    return MirrorMap(np.array(plain["permutation"], np.int64), np.array(plain["sign"], np.float32))


def mirrors_from_json(plain: Any) -> Mirrors | None:
    """Both mirrors of a network's architecture, if it has any."""
    return None if plain is None else (mirror_from_json(plain[0]), mirror_from_json(plain[1]))


class Normalizer(nn.Module):
    """(x - mean) / std, clipped; statistics are fixed buffers of shape (size,)."""

    mean: Tensor
    std: Tensor

    def __init__(self, size: int, clip: float) -> None:
        super().__init__()
        self.clip = clip
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("std", torch.ones(size))

    def forward(self, x: Tensor) -> Tensor:
        return torch.clamp((x - self.mean) / self.std, -self.clip, self.clip)


class TeacherNetwork(nn.Module):
    """Mean action of the privileged teacher: (s_t, s_priv), shape (n, S + P), to a, shape (n, A)."""

    log_std: Tensor

    def __init__(
        self,
        inputs: int,
        actions: int,
        hidden: Sequence[int],
        activation: str,
        clip: float,
        mirrors: Any = None,
    ) -> None:
        """`mirrors`: of observation and action, as `mirror_as_json` gives them; the network then commutes with them."""
        super().__init__()
        self.normalizer = Normalizer(inputs, clip)
        self.body = perceptron(inputs, hidden, actions, activation, mirrors_from_json(mirrors))
        self.register_buffer("log_std", torch.zeros(actions))

    def forward(self, observation: Tensor) -> Tensor:
        return cast(Tensor, self.body(self.normalizer(observation)))


class MlpEncoder(nn.Module):
    """Normalised history, (n, K, S), to latent, (n, latent), as by `iowbc.rollouts.policies.HistoryEncoder`."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        self.activation, activate = activation, ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, features), activate())
        self.whole = nn.Sequential(nn.Linear(history * features, latent), activate())

    def forward(self, history: Tensor) -> Tensor:
        return self.whole(self.frame(history).flatten(1))


class MirroredEncoder(nn.Module):
    """Encoder of half the size, of a history and of its mirror image: mirroring swaps the halves of the latent."""

    permutation: Tensor
    sign: Tensor

    def __init__(self, encoder: MlpEncoder, mirror: MirrorMap) -> None:
        """`mirror`: of one observation."""
        super().__init__()
        self.encoder = encoder
        self.register_buffer("permutation", torch.from_numpy(mirror.permutation), persistent=False)
        self.register_buffer("sign", torch.from_numpy(mirror.as_float32().sign), persistent=False)

    def forward(self, history: Tensor) -> Tensor:
        first, activate = self.encoder.frame
        assert isinstance(first, nn.Linear)
        # mirror the weights rather than the histories: they are smaller
        mirrored = torch.index_select(first.weight * self.sign, 1, self.permutation)
        both = nn.functional.linear(history, torch.cat([first.weight, mirrored]), first.bias.repeat(2))
        own, image = activate(both).chunk(2, dim=-1)
        return torch.cat([self.encoder.whole(own.flatten(1)), self.encoder.whole(image.flatten(1))], dim=1)


class PrivilegedEstimate(nn.Module):
    """Linear map from the latent to s_priv in the teacher's normalisation; starts at zero, the mean of s_priv."""

    def __init__(self, latent: int, size: int, mirror: MirrorMap | None) -> None:
        """`size`: of s_priv; `mirror`: of s_priv if mirroring swaps the halves of the latent, else None."""
        super().__init__()
        self.head = nn.Linear(latent, size) if mirror is None else SymmetricHead(latent, mirror)
        for parameter in self.head.parameters():
            nn.init.zeros_(parameter)

    def forward(self, latent: Tensor) -> Tensor:
        if isinstance(self.head, nn.Linear):
            return cast(Tensor, self.head(latent))
        own, image = latent.chunk(2, dim=-1)
        return cast(Tensor, self.head(own + image, own - image))


def swap(pairs: int) -> MirrorMap:
    """Mirror that swaps the halves of a latent, shape (2 pairs,)."""
    places = np.arange(2 * pairs)
    return MirrorMap(np.roll(places, pairs), np.ones(2 * pairs, np.float32))


class StudentNetwork(nn.Module):
    """Mean action of the student: the history H_t, shape (n, K, S), oldest first, to a, shape (n, A).

    An encoder turns the history into a latent that describes the load's effect on the robot. The body receives the
    newest observation and either the latent or an estimate of s_priv from it.
    """

    log_std: Tensor

    def __init__(
        self,
        observation: int,
        history: int,
        actions: int,
        frame_features: int,
        latent: int,
        hidden: Sequence[int],
        activation: str,
        clip: float,
        encoder: str = "mlp",
        mirrors: Any = None,
        privileged: Any = None,
    ) -> None:
        """`observation`: size of the visible part of s_t, which may end before the object's pose. `mirrors`: as in
        `TeacherNetwork`. `privileged`: mirror of s_priv if the body receives an estimate of it, otherwise None."""
        super().__init__()
        del encoder  # named in the architectures of earlier versions, which had others, too
        self.observation, self.history = observation, history
        self.normalizer = Normalizer(observation, clip)
        both = mirrors_from_json(mirrors)
        extra = None if privileged is None else mirror_from_json(privileged)
        body = None
        self.encoder: MlpEncoder | MirroredEncoder
        if both is None:
            self.encoder = MlpEncoder(observation, history, frame_features, latent, activation)
        else:
            half = MlpEncoder(observation, history, frame_features, paired(latent), activation)
            self.encoder = MirroredEncoder(half, both[0])
            body = side_by_side((both[0], swap(paired(latent)) if extra is None else extra)), both[1]
        self.estimate = (
            None if extra is None else PrivilegedEstimate(latent, len(extra), None if both is None else extra)
        )
        seen = observation + (latent if extra is None else len(extra))
        self.body = perceptron(seen, hidden, actions, activation, body)
        self.register_buffer("log_std", torch.zeros(actions))

    def forward(self, history: Tensor) -> Tensor:
        return self.act(*self.read(history))

    def read(self, history: Tensor) -> tuple[Tensor, Tensor]:
        """The newest observation, normalised, and the latent."""
        normal = self.normalizer(history)
        return normal[:, -1], self.encoder(normal)

    def act(self, newest: Tensor, latent: Tensor) -> Tensor:
        return cast(Tensor, self.body(torch.cat([newest, self.body_context(latent)], dim=1)))

    def body_context(self, latent: Tensor) -> Tensor:
        """Second input of the body: the latent, or the estimate of s_priv."""
        return latent if self.estimate is None else cast(Tensor, self.estimate(latent))


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
