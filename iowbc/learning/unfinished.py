"""The policy of a teacher's training that is not finished, from its newest checkpoint, which is only read."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load

from iowbc.errors import Damaged
from iowbc.files import previous, read_checked
from iowbc.learning.acting import TeacherPolicy
from iowbc.learning.checkpoint import under
from iowbc.learning.networks import Mirrors, TeacherNetwork, mirror_as_json
from iowbc.recipe.teacher import Teacher


def unfinished_teacher(path: Path, key: str, settings: Teacher, mirrors: Mirrors) -> TeacherPolicy:
    """The teacher as the checkpoint at `path` of the stage's key has it, or the one before it where that is damaged.

    mirrors: of observation and action. Raises `Damaged` where there is no whole checkpoint.
    """
    for candidate in (path, previous(path)):
        try:
            content = read_checked(candidate, key)
        except Damaged:
            continue
        if content is not None:
            return TeacherPolicy(_network(under("policy", load(content)), settings, mirrors))
    raise Damaged(f"{path}: no whole checkpoint of this training")


def _network(policy: Mapping[str, NDArray[Any]], settings: Teacher, mirrors: Mirrors) -> TeacherNetwork:
    symmetric = settings.symmetry == "construction"
    network = TeacherNetwork(
        inputs=policy["normalizer.mean"].size,
        actions=mirrors[1].sign.size,
        hidden=settings.hidden,
        activation=settings.activation,
        clip=settings.normalization_clip,
        mirrors=[mirror_as_json(mirror) for mirror in mirrors] if symmetric else None,
    )
    for part, name in ((network.normalizer, "normalizer."), (network.body, "actor.")):
        arrays = {key.removeprefix(name): value for key, value in policy.items() if key.startswith(name)}
        part.load_state_dict({key: torch.from_numpy(np.array(value)) for key, value in arrays.items()})
    network.requires_grad_(False)
    return network.eval()
