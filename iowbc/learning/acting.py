"""Trained policies as functions of the batched observation, for evaluation and play."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load

from iowbc.errors import Damaged
from iowbc.files import previous, read_checked
from iowbc.learning.checkpoint import under
from iowbc.learning.networks import Mirrors, StudentNetwork, TeacherNetwork
from iowbc.learning.policy import trained_network
from iowbc.learning.storage import Network, load_network, require_layout
from iowbc.recipe.teacher import Teacher
from iowbc.rollouts.policies import History


class Policy(Protocol):
    """A deterministic controller of n environments."""

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Clear the history of the marked environments, shape (n,); call before the first `act` of an episode."""

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean residual action, shape (n, A), from s_t, shape (n, S), and s_priv, shape (n, P)."""


class TeacherPolicy:
    """The privileged teacher; it has no memory."""

    def __init__(self, network: TeacherNetwork) -> None:
        self.network = network

    def reset(self, which: NDArray[np.bool_]) -> None:
        del which

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        with torch.inference_mode():
            mean = self.network(torch.from_numpy(np.concatenate([observation, privileged], axis=1)))
        return np.asarray(mean.numpy(), np.float32)


class StudentPolicy:
    """The student with its observation history."""

    def __init__(self, network: StudentNetwork) -> None:
        self.network = network
        self.history: History | None = None
        self.starts: NDArray[np.bool_] = np.ones(0, np.bool_)

    def reset(self, which: NDArray[np.bool_]) -> None:
        if self.starts.shape != which.shape:
            self.starts = np.ones(which.shape, np.bool_)
            self.history = None
        self.starts |= which

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        if self.history is None:
            self.history = History(len(observation), self.network.history, self.network.observation)
            self.starts = np.ones(len(observation), np.bool_)
        frames = self.history.push(observation[:, : self.network.observation], self.starts)
        self.starts[:] = False
        with torch.inference_mode():
            mean = self.network(torch.from_numpy(frames))
        return np.asarray(mean.numpy(), np.float32)


def load_policy(folder: Path, layout: Mapping[str, Any] | None = None) -> Policy:
    """The policy in the artifact of `teacher` or `distill`. Raises FileNotFoundError where there is none, and
    StageFailed if it was trained on other parts than those of the `layout` that it will receive."""
    network, about = load_network(folder)
    if layout is not None:
        require_layout(folder, about, layout)
    return policy_of(network)


def policy_of(network: Network) -> Policy:
    return TeacherPolicy(network) if isinstance(network, TeacherNetwork) else StudentPolicy(network)


def unfinished_policy(path: Path, key: str, settings: Teacher, mirrors: Mirrors) -> Policy:
    """Policy of a training in progress, from its last intact checkpoint at `path`; raises `Damaged` if there is none.
    `key`: of the stage; `mirrors`: of a row (s_t, s_priv) and of an action."""
    for candidate in (path, previous(path)):
        try:
            content = read_checked(candidate, key)
        except Damaged:
            continue
        if content is not None:
            saved = load(content)
            weights = under("policy", saved) | under("average", saved)
            return policy_of(trained_network(weights, settings, mirrors)[0])
    raise Damaged(f"{path}: no whole checkpoint of this training")
