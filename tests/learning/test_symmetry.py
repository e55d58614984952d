import numpy as np
import torch
from gymnasium import spaces

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


def test_a_minibatch_shows_samples_or_their_whole_mirror_image() -> None:
    observation_space, action_space = spaces.Box(-9, 9, (3,)), spaces.Box(-9, 9, (1,))
    action_mirror = MirrorMap(np.array([0]), np.array([-1], np.float32))
    buffer = MirroredRolloutBuffer(
        64, observation_space, action_space, "cpu", observation_mirror=SWAP, action_mirror=action_mirror
    )
    for _ in range(64):
        buffer.add(
            np.array([[1.0, 2.0, 3.0]]), np.array([[4.0]]), np.zeros(1), np.zeros(1), torch.zeros(1), torch.zeros(1)
        )
    (samples,) = buffer.get(64)
    pairs = {(tuple(o.tolist()), float(a)) for o, a in zip(samples.observations, samples.actions, strict=True)}
    assert pairs == {((1, 2, 3), 4.0), ((2, 1, -3), -4.0)}
