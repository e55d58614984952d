"""PPO of the student's own network: it sees the history alone, the value sees what is privileged."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from mirrored import mirror_tensor
from point_masses import MIRRORS, PointMasses
from point_masses import SETTINGS as POINT_MASSES

from iowbc.learning.acting import StudentPolicy, policy_of, unfinished_policy
from iowbc.learning.as_numpy import student_policy
from iowbc.learning.checkpoint import save_checkpoint
from iowbc.learning.environments import HistoryEnvironments
from iowbc.learning.networks import StudentNetwork
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import HistoryNetwork, Teacher
from iowbc.robot.mirror import MirrorMap
from iowbc.rollouts.rollout import ExploringPolicy

pytestmark = pytest.mark.integration

SEEN, LENGTH = 2, 4
"""Of a mass its position and velocity are observed; the distance is privileged."""
NETWORK = HistoryNetwork(length=LENGTH, frame_features=8, latent=8)
SETTINGS = POINT_MASSES.model_copy(update={"steps": 16 * 8 * 60, "history": NETWORK})


def training(**changes: Any) -> TeacherTraining:
    environments = HistoryEnvironments(PointMasses(), SEEN, LENGTH)
    return TeacherTraining(Learner(SETTINGS.model_copy(update=changes), environments, MIRRORS, seed=3))


def test_the_history_ends_with_the_newest_observation_and_an_episode_with_its_own() -> None:
    inner = PointMasses()
    some = HistoryEnvironments(inner, SEEN, LENGTH)
    first = some.reset()
    assert first.shape == (8, LENGTH * SEEN + 1)
    np.testing.assert_array_equal(first[:, : LENGTH * SEEN], np.tile(inner.observed()[:, :SEEN], LENGTH))
    before = first
    for _ in range(20):
        rows, _, ended, infos = some.step(np.full((8, 1), 0.3, np.float32))
        for index in np.flatnonzero(ended):
            last = infos[index]["terminal_observation"]
            np.testing.assert_array_equal(last[: (LENGTH - 1) * SEEN], before[index, SEEN : LENGTH * SEEN])
            assert last[-1] == abs(last[-3]), "position, velocity, distance of the moment it ended"
            np.testing.assert_array_equal(rows[index, : LENGTH * SEEN], np.tile(inner.start[index], LENGTH))
        goes_on = ~ended
        np.testing.assert_array_equal(
            rows[goes_on, : (LENGTH - 1) * SEEN], before[goes_on, SEEN : LENGTH * SEEN], "shifted by one"
        )
        before = rows


def test_the_rows_of_a_rollout_are_those_of_its_steps() -> None:
    whole, single = (HistoryEnvironments(PointMasses(), SEEN, LENGTH) for _ in range(2))
    student = student_policy(StudentNetwork(SEEN, LENGTH, 1, 8, 8, (16,), "elu", 10.0))
    noise = np.random.default_rng(0).normal(size=(30, 8, 1)).astype(np.float32)
    np.testing.assert_array_equal(whole.reset(), single.reset())
    for _ in range(2):
        found = whole.roll(ExploringPolicy(student, noise, 1), 30)
        histories = found.observation[:-1, :, : LENGTH * SEEN].reshape(30, 8, LENGTH, SEEN)
        expected = student(histories) + noise
        np.testing.assert_allclose(found.action, expected, rtol=1e-6, atol=4e-6, err_msg="acts on what it tells")
        last = []
        for step in range(30):
            rows, _, ended, infos = single.step(found.action[step].clip(-1, 1))
            np.testing.assert_array_equal(found.observation[step + 1], rows)
            last += [infos[index]["terminal_observation"] for index in np.flatnonzero(ended)]
        np.testing.assert_array_equal(found.cut_observation, last)


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_it_learns_and_a_resumed_training_is_the_unbroken_one_bit_for_bit(symmetry: str) -> None:
    unbroken = training(symmetry=symmetry)
    first = unbroken.update()["reward"]
    unbroken.update()
    kept = {name: np.array(value) for name, value in unbroken.arrays().items()}
    while unbroken.steps < unbroken.planned:
        last = unbroken.update()["reward"]
    assert last > 0.5 * first, (first, last)
    resumed = training(symmetry=symmetry)
    resumed.restore(kept)
    while resumed.steps < resumed.planned:
        resumed.update()
    for name, value in unbroken.arrays().items():
        np.testing.assert_array_equal(resumed.arrays()[name], value, err_msg=name)


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_what_it_leaves_acts_as_it_trained_and_knows_nothing_privileged(symmetry: str) -> None:
    some = training(symmetry=symmetry)
    some.update()
    network, _ = some.network()
    rows = torch.from_numpy(np.random.default_rng(0).normal(size=(6, LENGTH * SEEN + 1)).astype(np.float32))
    histories = rows[:, : LENGTH * SEEN].reshape(6, LENGTH, SEEN)
    policy = some.model.policy
    with torch.no_grad():
        torch.testing.assert_close(network(histories), policy.get_distribution(rows).mode(), rtol=0, atol=1e-6)
        other = rows.clone()
        other[:, -1] += 1.0
        assert torch.equal(policy.get_distribution(other).mode(), policy.get_distribution(rows).mode())
        assert not torch.equal(policy.predict_values(other), policy.predict_values(rows))
        if symmetry == "construction":
            mirror = MirrorMap(MIRRORS[0].permutation[:SEEN], MIRRORS[0].sign[:SEEN])
            mirrored = network(mirror_tensor(mirror, histories))
            torch.testing.assert_close(mirrored, mirror_tensor(MIRRORS[1], network(histories)), rtol=0, atol=1e-6)
    assert isinstance(policy_of(network), StudentPolicy)


def test_it_can_be_looked_at_while_it_trains(tmp_path: Path) -> None:
    some, path = training(), tmp_path / "training.checkpoint"
    some.update()
    save_checkpoint(path, "key", some.arrays())
    shown, own = unfinished_policy(path, "key", SETTINGS, MIRRORS), policy_of(some.network()[0])
    seen, none = np.random.default_rng(0).normal(size=(3, 5, SEEN)).astype(np.float32), np.zeros((5, 1), np.float32)
    for frame in seen:
        np.testing.assert_array_equal(shown.act(frame, none), own.act(frame, none))


def test_an_odd_latent_is_refused() -> None:
    with pytest.raises(ValueError, match="7 is odd"):
        Teacher(history=HistoryNetwork(latent=7))
