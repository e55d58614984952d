from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv

from iowbc.learning import checkpoint, ppo
from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap

SETTINGS = Teacher(
    steps=16 * 8 * 6,
    environments=8,
    rollout=16,
    minibatches=2,
    hidden=(16,),
    learning_rate=1e-2,
)
ODD = MirrorMap(np.array([0, 1]), np.array([-1, -1], np.float32)), MirrorMap(np.array([0]), np.array([-1], np.float32))


class PushToCentre(VecEnv):  # type: ignore[misc]
    """Unit masses on a line, rewarded for resting at zero; the task is its own mirror image."""

    def __init__(self) -> None:
        super().__init__(8, spaces.Box(-np.inf, np.inf, (2,)), spaces.Box(-1, 1, (1,)))
        self.state = np.tile(np.linspace(-1, 1, 8)[:, None], (1, 2)).astype(np.float32)

    def reset(self) -> Any:
        return self.state.copy()

    def step_async(self, actions: Any) -> None:
        self.state[:, 1] = 0.9 * self.state[:, 1] + 0.2 * actions[:, 0]
        self.state[:, 0] += 0.2 * self.state[:, 1]

    def step_wait(self) -> Any:
        reward = -(self.state**2).sum(1)
        return self.state.copy(), reward, np.zeros(8, np.bool_), [{} for _ in range(8)]

    def close(self) -> None: ...
    def get_attr(self, name: str, indices: Any = None) -> Any:
        return [None] * 8

    def set_attr(self, name: str, value: Any, indices: Any = None) -> None: ...
    def env_method(self, name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any: ...
    def env_is_wrapped(self, wrapper: Any, indices: Any = None) -> Any:
        return [False] * 8


class Stop(Exception):
    pass


def train(path: Path, stop_after: int | None = None) -> dict[str, np.ndarray]:
    env = PushToCentre()
    normalised = ppo.normalize(env, SETTINGS, ODD)
    model = ppo.make_ppo(SETTINGS, normalised, 3, ODD)
    found = checkpoint.load_checkpoint(path, "key", print)
    if found:
        env.state = found[0]["environment/state"].copy()
        ppo.restore_ppo(model, normalised, found[0])
    count = 0

    def after(training: dict[str, float]) -> None:
        nonlocal count
        count += 1
        ppo.adapt_learning_rate(model, SETTINGS, training["train/approx_kl"])
        arrays = {**ppo.ppo_arrays(model, normalised), "environment/state": env.state}
        checkpoint.save_checkpoint(path, "key", arrays, {})
        if count == stop_after:
            raise Stop

    remaining = SETTINGS.steps - model.num_timesteps
    model.learn(remaining, ppo.AfterUpdate(after), log_interval=None, reset_num_timesteps=False)
    return checkpoint.module_arrays(model.policy)


def test_a_resumed_training_ends_bit_for_bit_where_an_unbroken_one_does(tmp_path: Path) -> None:
    torch.set_num_threads(1)
    unbroken = train(tmp_path / "a.safetensors")
    with pytest.raises(Stop):
        train(tmp_path / "b.safetensors", stop_after=3)
    np.random.seed(99)  # noqa: NPY002 - SB3 draws from the global generator
    torch.manual_seed(99)
    resumed = train(tmp_path / "b.safetensors")
    for name, value in unbroken.items():
        np.testing.assert_array_equal(resumed[name], value, err_msg=name)


def test_the_network_that_is_kept_acts_as_the_trained_policy(tmp_path: Path) -> None:
    env = PushToCentre()
    normalised = ppo.normalize(env, SETTINGS, None)
    model = ppo.make_ppo(SETTINGS, normalised, 0, None)
    model.learn(SETTINGS.steps)
    network, _ = ppo.teacher_network(model, normalised, SETTINGS)
    raw = np.random.default_rng(0).normal(size=(9, 2)).astype(np.float32)
    expected = model.policy.get_distribution(torch.from_numpy(normalised.normalize_obs(raw))).mode()
    torch.testing.assert_close(network(torch.from_numpy(raw)), expected, rtol=1e-5, atol=1e-6)


def test_a_checkpoint_of_another_key_is_not_used(tmp_path: Path) -> None:
    path, said = tmp_path / "checkpoint.safetensors", list[str]()
    checkpoint.save_checkpoint(path, "one", {"x": np.arange(3)}, {"rounds": 4})
    found = checkpoint.load_checkpoint(path, "one", said.append)
    assert found is not None
    assert found[1] == {"rounds": 4}
    assert checkpoint.load_checkpoint(path, "two", said.append) is None
    assert checkpoint.load_checkpoint(tmp_path / "none", "one", said.append) is None
    assert said == []


def truncated(content: bytes) -> bytes:
    return content[:40]


def flipped(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 1])


@pytest.mark.parametrize("damage", [truncated, flipped, lambda content: b"", lambda content: bytes(len(content))])
def test_a_damaged_checkpoint_is_named_and_the_previous_one_used(
    damage: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    path, said = tmp_path / "checkpoint.safetensors", list[str]()
    for rounds in (1, 2, 3):
        checkpoint.save_checkpoint(path, "k", {"x": np.arange(rounds)}, {"rounds": rounds})
    path.write_bytes(damage(path.read_bytes()))
    found = checkpoint.load_checkpoint(path, "k", said.append)
    assert found is not None
    assert found[1] == {"rounds": 2}
    assert len(found[0]["x"]) == 2
    assert said == ["checkpoint checkpoint.safetensors is damaged: goes on from the previous one"]

    assert (tmp_path / "checkpoint.safetensors.damaged").is_file()
    checkpoint.save_checkpoint(path, "k", {"x": np.arange(3)}, {"rounds": 3})
    path.unlink()
    found = checkpoint.load_checkpoint(path, "k", said.append)
    assert found is not None
    assert found[1] == {"rounds": 2}, "the previous one is still the whole one"

    checkpoint.previous_checkpoint(path).unlink()
    path.write_bytes(b"damaged")
    said.clear()
    assert checkpoint.load_checkpoint(path, "k", said.append) is None
    assert said == ["checkpoint checkpoint.safetensors is damaged: starts anew"]


def test_an_unfinished_write_leaves_the_old_checkpoint(tmp_path: Path) -> None:
    path, said = tmp_path / "checkpoint.safetensors", list[str]()
    checkpoint.save_checkpoint(path, "k", {"x": np.arange(3)}, {})
    (tmp_path / "checkpoint.fresh").write_bytes(b"half")
    assert checkpoint.load_checkpoint(path, "k", said.append) is not None
    path.rename(checkpoint.previous_checkpoint(path))
    assert checkpoint.load_checkpoint(path, "k", said.append) is not None
    assert said == []


def test_the_step_size_follows_the_kl_divergence_within_its_bounds() -> None:
    env = PushToCentre()
    settings = SETTINGS.model_copy(update={"learning_rate": 1e-3, "learning_rate_range": (5e-4, 1.1e-3)})
    model = ppo.make_ppo(settings, ppo.normalize(env, settings, None), 0, None)
    assert ppo.adapt_learning_rate(model, settings, kl=0.04) == 1e-3
    assert ppo.adapt_learning_rate(model, settings, kl=0.01) == 1.1e-3
    for _ in range(9):
        rate = ppo.adapt_learning_rate(model, settings, kl=0.2)
    assert rate == 5e-4
    assert model.lr_schedule(0.5) == 5e-4
