import numpy as np

from iowbc.rollouts.policies import History


def test_an_episode_begins_with_copies_of_its_first_observation() -> None:
    history = History(2, 3, 1)
    first = np.array([[1.0], [2.0]], np.float32)
    frames = history.push(first, np.array([True, True]))
    assert frames[:, :, 0].tolist() == [[1, 1, 1], [2, 2, 2]]


def test_the_oldest_observation_leaves_first_and_only_the_new_episode_is_refilled() -> None:
    history = History(2, 3, 1)
    history.push(np.array([[1.0], [10.0]], np.float32), np.array([True, True]))
    history.push(np.array([[2.0], [20.0]], np.float32), np.array([False, False]))
    frames = history.push(np.array([[3.0], [30.0]], np.float32), np.array([False, True]))
    assert frames[:, :, 0].tolist() == [[1, 2, 3], [30, 30, 30]]
