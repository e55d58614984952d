"""Normalisation of observations and rewards by running statistics in training."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.running_mean_std import RunningMeanStd

from iowbc.learning.checkpoint import Arrays
from iowbc.learning.networks import Normalizer
from iowbc.robot.mirror import MirrorMap

VARIANCE_FLOOR = 1e-4
"""Added to variances, so that an input that is almost constant in training is not amplified when it changes."""
LARGEST_REWARD = 10.0
"""Normalised rewards are clipped to this."""


class SymmetricMeanStd(RunningMeanStd):  # type: ignore[misc]
    """Running mean and variance over samples and their mirror images, so that normalising commutes with the mirror."""

    def __init__(self, mirror: MirrorMap) -> None:
        super().__init__(shape=mirror.sign.shape)
        self.mirror = mirror

    def update(self, arr: NDArray[np.float32]) -> None:
        own, spread = arr.mean(axis=0, dtype=np.float64), arr.var(axis=0, dtype=np.float64)
        image = self.mirror(own)
        variance = 0.5 * (spread + spread[self.mirror.permutation]) + (0.5 * (own - image)) ** 2
        self.update_from_moments(0.5 * (own + image), variance, 2 * len(arr))


class Normalization:
    """Mean and variance of observations, and variance of the discounted return, which scales rewards."""

    def __init__(self, observations: int, environments: int, discount: float, mirror: MirrorMap | None) -> None:
        """`mirror`: of the observations if normalisation must commute with it, else None."""
        self.observations = RunningMeanStd(shape=(observations,)) if mirror is None else SymmetricMeanStd(mirror)
        self.returns = RunningMeanStd(shape=())
        self.discount = discount
        self.discounted = np.zeros(environments)
        """Σ discount^k · reward of each environment's episode so far."""
        self.frozen = False
        """True while no statistics are updated."""
        self.inherited: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
        """Fixed mean and standard deviation of the first inputs, from a trained policy, or None."""

    def observe(self, observations: NDArray[np.float32]) -> None:
        """Update the statistics with observations, (n, size)."""
        if not self.frozen:
            self.observations.update(observations)

    def move(self, normalizer: Normalizer) -> None:
        """Copy the current statistics to the normaliser."""
        normalizer.mean.copy_(torch.from_numpy(self.observations.mean))
        normalizer.std.copy_(torch.from_numpy(np.sqrt(self.observations.var + VARIANCE_FLOOR)))
        if self.inherited is not None:
            mean, std = self.inherited
            normalizer.mean[: len(mean)] = torch.from_numpy(mean)
            normalizer.std[: len(std)] = torch.from_numpy(std)

    def reward(self, rewards: NDArray[np.float32], ended: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Rewards of a step, (n,), in standard deviations of the return; `ended`: where an episode ends."""
        self.discounted = self.discounted * self.discount + rewards
        if not self.frozen:
            self.returns.update(self.discounted)
        self.discounted[ended] = 0.0
        scaled = rewards / np.sqrt(self.returns.var + VARIANCE_FLOOR)
        return np.asarray(np.clip(scaled, -LARGEST_REWARD, LARGEST_REWARD), np.float32)

    def arrays(self) -> Arrays:
        """State for a checkpoint, except `frozen`, which follows from the step."""
        moments = {"observation": self.observations, "return": self.returns}
        inherited = {} if self.inherited is None else {"inherited": np.stack(self.inherited)}
        return {
            **inherited,
            "discounted": self.discounted.copy(),
            **{f"{name}_mean": np.array(of.mean) for name, of in moments.items()},
            **{f"{name}_variance": np.array(of.var) for name, of in moments.items()},
            **{f"{name}_count": np.array([of.count]) for name, of in moments.items()},
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.discounted = np.array(arrays["discounted"])
        if "inherited" in arrays:
            mean, std = np.array(arrays["inherited"])
            self.inherited = mean, std
        for name, of in (("observation", self.observations), ("return", self.returns)):
            of.mean, of.var = np.array(arrays[f"{name}_mean"]), np.array(arrays[f"{name}_variance"])
            of.count = float(arrays[f"{name}_count"][0])
