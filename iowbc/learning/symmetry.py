"""Left-right mirror symmetry in learning: normalisation that commutes with the mirror, and mirrored samples."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.type_aliases import RolloutBufferSamples
from stable_baselines3.common.vec_env.vec_normalize import VecNormalize

from iowbc.robot.mirror import MirrorMap


def mirror_tensor(mirror: MirrorMap, x: torch.Tensor) -> torch.Tensor:
    """The mirror image of a float32 tensor along its last axis."""
    return x[..., torch.from_numpy(mirror.permutation)] * torch.from_numpy(mirror.sign.astype(np.float32))


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
                mirrored, mirror_tensor(self.observation_mirror, samples.observations), samples.observations
            ),
            actions=torch.where(mirrored, mirror_tensor(self.action_mirror, samples.actions), samples.actions),
        )
