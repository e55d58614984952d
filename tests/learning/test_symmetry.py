import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy

from iowbc.learning.symmetry import MirroredRolloutBuffer, SymmetricMeanStd
from iowbc.robot.mirror import MirrorMap

SWAP = MirrorMap(np.array([1, 0, 2]), np.array([1, 1, -1], np.float32))


def test_normalising_commutes_with_the_mirror() -> None:
    random = np.random.default_rng(0)
    statistics = SymmetricMeanStd(SWAP)
    for _ in range(20):
        statistics.update(random.normal([1.0, 3.0, 5.0], [1.0, 2.0, 3.0], (64, 3)).astype(np.float32))
    x = random.normal(size=(10, 3)).astype(np.float32)
    normalised = (SWAP(x) - statistics.mean) / np.sqrt(statistics.var)
    np.testing.assert_allclose(normalised, SWAP((x - statistics.mean) / np.sqrt(statistics.var)), atol=1e-6)


def test_a_minibatch_shows_samples_or_their_whole_mirror_image_with_their_own_probability() -> None:
    observation_space, action_space = spaces.Box(-9, 9, (3,)), spaces.Box(-9, 9, (1,))
    action_mirror = MirrorMap(np.array([0]), np.array([-1], np.float32))
    buffer = MirroredRolloutBuffer(
        64, observation_space, action_space, "cpu", observation_mirror=SWAP, action_mirror=action_mirror
    )
    buffer.policy = ActorCriticPolicy(observation_space, action_space, lambda _: 1e-3)
    observation, action = torch.tensor([[1.0, 2.0, 3.0]]), torch.tensor([[4.0]])
    with torch.no_grad():
        _, probability, _ = buffer.policy.evaluate_actions(observation, action)
        _, mirrored, _ = buffer.policy.evaluate_actions(torch.tensor([[2.0, 1.0, -3.0]]), torch.tensor([[-4.0]]))
    for _ in range(64):
        buffer.add(observation.numpy(), action.numpy(), np.zeros(1), np.zeros(1), torch.zeros(1), probability)
    (samples,) = buffer.get(64)
    rows = {
        (tuple(o.tolist()), float(a), round(float(p), 5))
        for o, a, p in zip(samples.observations, samples.actions, samples.old_log_prob, strict=True)
    }
    assert rows == {
        ((1, 2, 3), 4.0, round(float(probability), 5)),
        ((2, 1, -3), -4.0, round(float(mirrored), 5)),
    }
