"""Conversion of a PPO policy to a deployable network, without exploration, value and optimiser; and back."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iowbc.learning.gaussian import std_places
from iowbc.learning.history_actor import HistoryActor, student_architecture
from iowbc.learning.networks import Mirrors, StudentNetwork, TeacherNetwork, mirrors_as_json
from iowbc.learning.policy import ActorCritic
from iowbc.learning.storage import Network
from iowbc.recipe.teacher import Teacher


def trained_network(
    policy: Mapping[str, NDArray[Any]], settings: Teacher, mirrors: Mirrors
) -> tuple[Network, dict[str, Any]]:
    """Network of the policy's mean action, including normalisation, and the arguments that rebuild it.

    policy: parameters and buffers of an `ActorCritic`; mirrors: of a row (s_t, s_priv) and of an action.
    """
    arrays = {name: torch.from_numpy(np.array(value)) for name, value in policy.items()}
    mean, std = arrays["normalizer.mean"], arrays["normalizer.std"]
    actions = len(mirrors[1])
    network: Network
    with torch.random.fork_rng(devices=()):
        if settings.history is None:
            architecture = {
                "inputs": len(mean),
                "actions": actions,
                "hidden": list(settings.hidden),
                "activation": settings.activation,
                "clip": settings.normalization_clip,
                "mirrors": mirrors_as_json(mirrors, settings.symmetry),
            }
            network = TeacherNetwork(**architecture)
            network.body.load_state_dict(_part("actor.", arrays))
        else:
            seen = len(arrays["actor.network.normalizer.mean"])
            architecture = student_architecture(settings, seen, actions, mirrors)
            network = StudentNetwork(**architecture)
            network.load_state_dict(_part("actor.network.", arrays))
            mean, std = mean[:seen], std[:seen]
    network.normalizer.mean.copy_(mean)
    network.normalizer.std.copy_(std)
    symmetric = settings.symmetry == "construction"
    network.log_std.copy_(arrays["log_stds"][torch.from_numpy(std_places(actions, mirrors[1] if symmetric else None))])
    network.requires_grad_(False)
    return network.eval(), architecture


def load_policy_weights(policy: ActorCritic, network: Network) -> None:
    """Load a trained network's mean action and standard deviation into a PPO policy; its value network is unchanged.

    Raises RuntimeError if the networks have different architectures.
    """
    learnt = network.state_dict() if isinstance(network, StudentNetwork) else network.body.state_dict()
    actor = policy.actor.network if isinstance(policy.actor, HistoryActor) else policy.actor
    actor.load_state_dict(learnt)
    policy.hide()
    with torch.no_grad():
        policy.log_stds[policy.std_place] = network.log_std.to(policy.log_stds.device)


def _part(beginning: str, arrays: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name.removeprefix(beginning): value for name, value in arrays.items() if name.startswith(beginning)}
