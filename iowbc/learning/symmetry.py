"""Learning from mirror images: the alternative to networks that are symmetric by construction."""

import numpy as np
import torch
from torch import Tensor

from iowbc.learning.gaussian import log_density
from iowbc.learning.networks import Mirrors
from iowbc.learning.policy import ActorCritic
from iowbc.learning.rollout import Samples
from iowbc.robot.mirror import MirrorMap


def mirror_tensor(mirror: MirrorMap, x: Tensor) -> Tensor:
    """The mirror image of a float32 tensor along its last axis."""
    return x[..., torch.from_numpy(mirror.permutation)] * torch.from_numpy(mirror.sign.astype(np.float32)).to(x.device)


def mirror_images(samples: Samples, policy: ActorCritic, mirrors: Mirrors, gap: float) -> Tensor:
    """The mirror image of every sample; the sample itself where its image is too unlikely.

    Advantage and return equal those of the original, since the task is symmetric. Mean and density are recomputed in
    the mirrored state, so that the probability ratio starts at one. Images with a very unlikely action are not used:
    their gradient would grow without bound. `mirrors`: of observation and action; `gap`: largest drop of log density
    from original to image [nat].
    """
    rows = samples.flat
    images = rows.clone()
    old, new = samples.named(rows), samples.named(images)
    with torch.no_grad():
        new["observation"].copy_(mirror_tensor(mirrors[0], old["observation"]))
        new["action"].copy_(mirror_tensor(mirrors[1], old["action"]))
        new["mean"].copy_(policy.actor.head(policy.actor.hidden(new["observation"])))
        new["log_density"].copy_(log_density(new["action"], new["mean"], policy.log_std))
    unlikely = new["log_density"] < old["log_density"] - gap
    images[unlikely] = rows[unlikely]
    return images


def half_mirrored(samples: Tensor, images: Tensor) -> Tensor:
    """A random half of the samples replaced by their images."""
    return torch.where(torch.rand(len(samples), 1).to(samples.device) < 0.5, images, samples)
