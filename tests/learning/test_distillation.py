import numpy as np

from iowbc.learning.distillation import ReplayBuffer, spread
from iowbc.rollouts.policies import History


def test_a_sampled_history_is_the_one_that_the_student_saw() -> None:
    random = np.random.default_rng(0)
    history, experience = (
        History(3, 4, 2),
        ReplayBuffer(capacity=3 * 10, environments=3, observation=2, targets=1, history=4),
    )
    seen: dict[tuple[float, float], np.ndarray] = {}
    starts = np.ones(3, np.bool_)
    for _ in range(37):
        frame = random.normal(size=(3, 2)).astype(np.float32)
        frames = history.push(frame, starts).copy()
        experience.add(frame, frame[:, :1] * 2, starts)
        seen.update({(float(f[0]), float(f[1])): h for f, h in zip(frame, frames, strict=True)})
        starts = random.random(3) < 0.2
    histories, targets = experience.sample(500, random)
    for sampled, target in zip(histories, targets, strict=True):
        newest = sampled[-1]
        np.testing.assert_array_equal(sampled, seen[(float(newest[0]), float(newest[1]))])
        assert target[0] == newest[0] * 2


def test_the_ring_restores_exactly() -> None:
    random = np.random.default_rng(1)
    first = ReplayBuffer(40, 2, 3, 1, 5)
    for step in range(30):
        starts = np.full(2, step % 7 == 0)
        first.add(random.normal(size=(2, 3)).astype(np.float32), random.normal(size=(2, 1)).astype(np.float32), starts)
    second = ReplayBuffer(40, 2, 3, 1, 5)
    second.restore(first.arrays())
    for a, b in zip(
        first.sample(50, np.random.default_rng(2)), second.sample(50, np.random.default_rng(2)), strict=True
    ):
        np.testing.assert_array_equal(a, b)


def test_a_teacher_that_drives_some_drives_the_same_share_of_every_scene() -> None:
    driven = spread(96) < 0.5
    assert all(0.4 <= driven[first : first + 12].mean() <= 0.6 for first in range(84))
    assert not (spread(96) < 0.0).any()
    assert (spread(96) < 1.0).all()
