"""Mirror images of tensors."""

import numpy as np
import torch
from torch import Tensor

from iowbc.robot.mirror import MirrorMap


def mirror_tensor(mirror: MirrorMap, x: Tensor) -> Tensor:
    """The mirror image of a float32 tensor along its last axis."""
    return x[..., torch.from_numpy(mirror.permutation)] * torch.from_numpy(mirror.sign.astype(np.float32))
