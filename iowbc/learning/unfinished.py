"""The policy of a PPO training that is not finished, from its newest checkpoint, which is only read."""

from pathlib import Path

from safetensors.numpy import load

from iowbc.errors import Damaged
from iowbc.files import previous, read_checked
from iowbc.learning.acting import Policy, policy_of
from iowbc.learning.checkpoint import under
from iowbc.learning.networks import Mirrors
from iowbc.learning.trained import trained_network
from iowbc.recipe.teacher import Teacher


def unfinished_policy(path: Path, key: str, settings: Teacher, mirrors: Mirrors) -> Policy:
    """The policy as the checkpoint at `path` of the stage's key has it, or the one before it where that is damaged.

    mirrors: of a row (s_t, s_priv) and of an action. Raises `Damaged` where there is no whole checkpoint.
    """
    for candidate in (path, previous(path)):
        try:
            content = read_checked(candidate, key)
        except Damaged:
            continue
        if content is not None:
            return policy_of(*trained_network(under("policy", load(content)), settings, mirrors))
    raise Damaged(f"{path}: no whole checkpoint of this training")
