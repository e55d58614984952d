"""Left-right mirror symmetry in learning: normalisation that commutes with the mirror, and mirrored samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.type_aliases import RolloutBufferSamples
from stable_baselines3.common.vec_env.vec_normalize import VecNormalize


@dataclass(frozen=True)
class MirrorMap:
    """The mirror image of a vector x is sign * x[permutation]."""

    permutation: NDArray[np.intp]
    sign: NDArray[np.float32]

    def __call__(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mirror the last axis of an array."""
        return x[..., self.permutation] * self.sign

    def tensor(self, x: torch.Tensor) -> torch.Tensor:
        """Mirror the last axis of a tensor."""
        return x[..., torch.from_numpy(self.permutation)] * torch.from_numpy(self.sign)


class SymmetricMeanStd(RunningMeanStd):  # type: ignore[misc]
    """Running mean and variance over samples and their mirror images, so that normalising commutes with the mirror."""

    def __init__(self, mirror: MirrorMap) -> None:
        super().__init__(shape=mirror.sign.shape)
        self.mirror = mirror

    def update(self, arr: NDArray[np.float32]) -> None:
        super().update(np.concatenate([arr, self.mirror(arr)]))


class MirroredRolloutBuffer(RolloutBuffer):  # type: ignore[misc]
    """A rollout buffer that shows a random half of every minibatch as its mirror image.

    Observations must have been normalised with `SymmetricMeanStd`. Value, advantage and old probability are those of
    the original: the task is symmetric, and the policy nearly so once it learns from both.
    """

    def __init__(self, *args: Any, observation_mirror: MirrorMap, action_mirror: MirrorMap, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.observation_mirror = observation_mirror
        self.action_mirror = action_mirror

    def _get_samples(self, batch_inds: NDArray[np.intp], env: VecNormalize | None = None) -> RolloutBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        mirrored = torch.from_numpy(np.random.rand(len(batch_inds), 1) < 0.5)  # noqa: NPY002 - SB3's own generator
        return samples._replace(
            observations=torch.where(
                mirrored, self.observation_mirror.tensor(samples.observations), samples.observations
            ),
            actions=torch.where(mirrored, self.action_mirror.tensor(samples.actions), samples.actions),
        )
