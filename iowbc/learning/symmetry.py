"""Left-right mirror symmetry in learning: normalisation that commutes with the mirror, and mirrored samples."""

from collections.abc import Generator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.policies import ActorCriticPolicy
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

    Observations must have been normalised with `SymmetricMeanStd`. Advantage and return are those of the original,
    for the task is symmetric; the old probability is what the policy gives the mirrored action before the update, so
    that the probability ratio begins at one.
    """

    def __init__(self, *args: Any, observation_mirror: MirrorMap, action_mirror: MirrorMap, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.observation_mirror = observation_mirror
        self.action_mirror = action_mirror
        self.policy: ActorCriticPolicy | None = None
        self.mirrored_log_probs = torch.zeros(0)

    def get(self, batch_size: int | None = None) -> Generator[RolloutBufferSamples, None, None]:
        if not self.generator_ready:
            assert self.policy is not None, "set `policy` before the first update"
            observations = torch.from_numpy(self.swap_and_flatten(self.observations))
            actions = torch.from_numpy(self.swap_and_flatten(self.actions))
            with torch.no_grad():
                _, self.mirrored_log_probs, _ = self.policy.evaluate_actions(
                    mirror_tensor(self.observation_mirror, observations), mirror_tensor(self.action_mirror, actions)
                )
        yield from super().get(batch_size)

    def _get_samples(self, batch_inds: NDArray[np.intp], env: VecNormalize | None = None) -> RolloutBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        mirrored = torch.from_numpy(np.random.rand(len(batch_inds)) < 0.5)  # noqa: NPY002 - SB3's own generator
        row = mirrored[:, None]
        observations = mirror_tensor(self.observation_mirror, samples.observations)
        actions = mirror_tensor(self.action_mirror, samples.actions)
        log_probs = self.mirrored_log_probs[torch.from_numpy(batch_inds)]
        return samples._replace(
            observations=torch.where(row, observations, samples.observations),
            actions=torch.where(row, actions, samples.actions),
            old_log_prob=torch.where(mirrored, log_probs, samples.old_log_prob),
        )
