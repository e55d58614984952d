from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from mirrored import mirror_tensor
from point_masses import MIRRORS, SETTINGS, PointMasses
from stable_baselines3 import PPO

from iowbc.learning import ppo
from iowbc.learning.gaussian import log_density
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Restart, Teacher


def training(**changes: Any) -> TeacherTraining:
    return TeacherTraining(Learner(SETTINGS.model_copy(update=changes), PointMasses(), MIRRORS, seed=3))


def finish(some: TeacherTraining) -> TeacherTraining:
    while some.steps < some.planned:
        some.update()
    return some


@pytest.mark.parametrize("average", [None, 16 * 8 * 2])
@pytest.mark.parametrize("symmetry", ["construction", "none"])
@pytest.mark.parametrize("group", [1, 2])
def test_a_resumed_training_ends_bit_for_bit_where_an_unbroken_one_does(
    symmetry: str, average: int | None, group: int
) -> None:
    changes = {"symmetry": symmetry, "average_half_life": average, "group": group}
    unbroken = finish(training(**changes))
    broken = training(**changes)
    for _ in range(3):
        broken.update()
    kept = {name: value.copy() for name, value in broken.arrays().items()}
    torch.manual_seed(99)
    resumed = training(**changes)
    resumed.restore(kept)
    assert resumed.steps == 3 * 16 * 8
    finish(resumed)
    expected, found = unbroken.arrays(), resumed.arrays()
    assert expected.keys() == found.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


def test_a_group_goes_on_with_the_return_of_its_leader(monkeypatch: pytest.MonkeyPatch) -> None:
    some, copied = training(group=4), []
    some.update()
    before, copy = some.model.normalization.discounted.copy(), some.model.env.copy
    monkeypatch.setattr(some.model.env, "copy", lambda leaders: copied.append(leaders) or copy(leaders))
    kept = some.model.normalization.reward
    seen = []
    monkeypatch.setattr(
        some.model.normalization,
        "reward",
        lambda *step: seen.append(some.model.normalization.discounted.copy()) or kept(*step),
    )
    some.update()
    assert np.array_equal(seen[0], before[copied[0]])
    assert len(set(copied[0])) == 2


def test_a_training_from_another_policy_begins_within_its_own_exploration() -> None:
    given, _ = training(initial_std=0.5).network()
    some = training(initial_std=0.1, std_half_life=None, std_end=0.1)
    some.begin(given)
    own = training(initial_std=0.1, std_half_life=16 * 8, std_end=0.1)
    own.begin(given)
    assert own.model.policy.log_std.exp().max().item() == pytest.approx(0.1)
    assert some.model.policy.log_std.exp().max().item() == pytest.approx(0.5), "without a half-life there is no ceiling"


class Lottery(PointMasses):
    """Rewards that do not depend on actions."""

    def __init__(self) -> None:
        super().__init__()
        self.random = np.random.default_rng(0)

    def step_wait(self) -> Any:
        observed, reward, ended, infos = super().step_wait()
        return observed, self.random.normal(size=len(reward)), ended, infos


@pytest.mark.parametrize(("task", "learnable"), [(PointMasses, True), (Lottery, False)])
def test_the_gain_of_an_update_on_the_next_rollout_shows_whether_it_was_noise(task: Any, learnable: bool) -> None:
    some = TeacherTraining(Learner(SETTINGS.model_copy(update={"steps": 16 * 8 * 60}), task(), MIRRORS, seed=3))
    figures = [some.update() for _ in range(60)]
    assert "train/gain" not in figures[0]
    gain = np.mean([one["train/gain"] for one in figures[1:]])
    promised = np.mean([-one["train/policy_loss"] for one in figures[:-1]])
    assert promised > 0.001
    assert (gain > 0.5 * promised) == learnable


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_what_the_value_alone_is_told_moves_no_action(symmetry: Any) -> None:
    settings = SETTINGS.model_copy(update={"symmetry": symmetry})
    some = finish(TeacherTraining(Learner(settings, PointMasses(), MIRRORS, seed=3, value_only=[2])))
    network, _ = some.network()
    rows = torch.randn(20, 3)
    told = rows + torch.tensor([0.0, 0.0, 0.5])
    policy = some.model.policy
    with torch.no_grad():
        torch.testing.assert_close(network(told), network(rows), rtol=0, atol=0)
        torch.testing.assert_close(policy(told, deterministic=True)[0], network(rows), rtol=0, atol=1e-5)
        assert float((policy.predict_values(told) - policy.predict_values(rows)).abs().max()) > 1e-3


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_the_mean_of_its_policies_is_what_a_training_leaves_and_changes_nothing_else(symmetry: Any) -> None:
    newest = training(symmetry=symmetry)
    expected = {name: value.numpy().copy() for name, value in newest.model.policy.state_dict().items()}
    for _ in range(4):
        newest.update()
        for name, value in newest.model.policy.state_dict().items():
            expected[name] = 0.5 * expected[name] + 0.5 * value.numpy()
    mean = training(symmetry=symmetry, average_half_life=16 * 8)
    for _ in range(4):
        mean.update()
    for name, value in newest.model.policy.state_dict().items():
        np.testing.assert_array_equal(mean.model.policy.state_dict()[name], value, err_msg=name)
    network, _ = mean.network()
    for name, value in network.body.state_dict().items():
        np.testing.assert_allclose(value, expected[f"actor.{name}"], rtol=1e-5, atol=1e-6, err_msg=name)


def test_what_a_check_of_the_mean_finds_best_is_kept_as_it_was() -> None:
    scores = iter([1.0, 0.5])
    settings = SETTINGS.model_copy(
        update={
            "average_half_life": 16 * 8,
            "check": SETTINGS.check.model_copy(update={"every": 2}),
            "steps": 16 * 8 * 3,
        }
    )
    some = TeacherTraining(Learner(settings, PointMasses(), MIRRORS, seed=3), score=lambda _: {"score": next(scores)})
    some.update()
    some.update()
    rows = torch.randn(20, 3)
    best = some.network()[0](rows)
    some.update()
    assert float((some.network()[0](rows) - best).abs().max()) > 1e-4
    some.keep_best()
    torch.testing.assert_close(some.network()[0](rows), best, rtol=0, atol=0)


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_what_begins_from_a_trained_policy_lets_its_value_learn_first(symmetry: Any) -> None:
    given, _ = finish(training(symmetry=symmetry)).network()
    rows = torch.randn(20, 3)

    def begun() -> TeacherTraining:
        some = training(symmetry=symmetry, value_first=2 * 16 * 8)
        some.begin(given)
        return some

    def acts(some: TeacherTraining) -> torch.Tensor:
        with torch.no_grad():
            return some.network()[0](rows)

    some = begun()
    rate, value = some.model.learning_rate, some.model.policy.predict_values(rows).detach()
    for _ in range(2):
        some.update()
        torch.testing.assert_close(acts(some), given(rows), rtol=0, atol=0)
    torch.testing.assert_close(some.model.policy.log_std, given.log_std, rtol=0, atol=1e-6)
    assert some.model.learning_rate == rate, "a divergence of nothing says nothing"
    assert float((some.model.policy.predict_values(rows).detach() - value).abs().max()) > 1e-2
    kept = some.arrays()
    finish(some)
    assert float((acts(some) - given(rows)).abs().max()) > 1e-3
    resumed = begun()
    resumed.restore(kept)
    torch.testing.assert_close(acts(finish(resumed)), acts(some), rtol=0, atol=0)


def test_what_the_value_alone_is_told_is_hidden_from_a_policy_that_knew_it() -> None:
    given, _ = finish(training()).network()
    some = TeacherTraining(Learner(SETTINGS, PointMasses(), MIRRORS, seed=3, value_only=[2]))
    some.begin(given)
    network, _ = some.network()
    rows = torch.randn(20, 3)
    told = rows + torch.tensor([0.0, 0.0, 0.5])
    with torch.no_grad():
        torch.testing.assert_close(network(told), network(rows), rtol=0, atol=0)
        assert float((given(told) - given(rows)).abs().max()) > 1e-3


@pytest.mark.parametrize(
    "changes",
    [
        {"symmetry": "construction"},
        {"symmetry": "none"},
        {"symmetry": "none", "group": 4},
        {"symmetry": "construction", "noise_correlation": 0.7},
    ],
)
def test_training_learns_to_bring_masses_to_rest(changes: dict[str, Any]) -> None:
    some = training(steps=16 * 8 * 60, **changes)
    first = some.update()["reward"]
    finish(some)
    assert some.update()["reward"] > 0.4 * first, "rewards are negative: squared distances and speeds"


def test_the_trained_policy_obeys_the_mirror_law() -> None:
    some = finish(training())
    network, _ = some.network()
    x = 3.0 * torch.randn(50, 3)
    with torch.no_grad():
        found = network(mirror_tensor(MIRRORS[0], x))
        torch.testing.assert_close(found, mirror_tensor(MIRRORS[1], network(x)), rtol=0, atol=1e-5)
        values = some.model.policy.predict_values(x)
        torch.testing.assert_close(
            some.model.policy.predict_values(mirror_tensor(MIRRORS[0], x)), values, rtol=0, atol=1e-5
        )


def test_the_network_that_is_kept_acts_as_the_trained_policy_and_as_its_zip_for_others(tmp_path: Path) -> None:
    some = finish(training())
    network, _ = some.network()
    raw = np.random.default_rng(0).normal(size=(9, 3)).astype(np.float32)
    own = some.model.policy.get_distribution(torch.from_numpy(raw)).mode()
    torch.testing.assert_close(network(torch.from_numpy(raw)), own, rtol=1e-5, atol=1e-6)
    some.model.save_for_sb3(tmp_path / "teacher_sb3.zip")
    loaded = PPO.load(tmp_path / "teacher_sb3.zip", device="cpu")
    action, _ = loaded.predict(raw, deterministic=True)
    np.testing.assert_allclose(action, own.detach().numpy().clip(-1, 1), rtol=1e-5, atol=1e-6)


def test_learning_in_bfloat16_follows_that_in_float32_within_its_rounding() -> None:
    states = []
    for precision in ("float32", "bfloat16"):
        some = training(precision=precision)
        some.update()
        states.append(some.model.policy.state_dict())
    ours, theirs = states
    changed = [name for name in ours if not torch.equal(ours[name], theirs[name])]
    assert changed, "bfloat16 rounds"
    for name in ours:
        torch.testing.assert_close(ours[name], theirs[name], rtol=0.02, atol=2e-2)


def test_the_step_size_follows_the_kl_divergence_within_its_bounds() -> None:
    settings = SETTINGS.model_copy(update={"learning_rate_range": (5e-4, 1.1e-3)})
    assert ppo.adapted(1e-3, 0.012, settings) == 1e-3
    assert ppo.adapted(1e-3, 0.004, settings) == 1.1e-3
    assert ppo.adapted(1e-3, 0.03, settings) == pytest.approx(8e-4)
    assert ppo.adapted(5.1e-4, 0.03, settings) == 5e-4
    assert ppo.adapted(1e-2, 9.0, settings.model_copy(update={"desired_kl": None})) == 1e-2


def test_exploration_shrinks_with_its_ceiling_and_never_below_its_floor() -> None:
    settings = Teacher(initial_std=0.4, std_half_life=100, std_end=0.15, std_floor=0.01)
    assert ppo.deviation_bounds(settings, 0) == (0.01, 0.4)
    assert ppo.deviation_bounds(settings, 100) == (0.01, 0.2)
    assert ppo.deviation_bounds(settings, 10_000) == (0.01, 0.15)
    some = training(std_half_life=16 * 8, std_end=0.2)
    for _ in range(3):
        some.update()
    assert float(some.model.policy.log_std.exp().detach()) <= 0.2 * (1 + 1e-6)


def test_a_restart_brings_exploration_back_once_and_lets_it_sink_anew() -> None:
    settings = Teacher(std_half_life=100, std_end=0.1, restart=Restart(after=300, std=0.4, half_life=50))
    assert ppo.deviation_bounds(settings, 299) == (0.05, 0.1)
    assert ppo.deviation_bounds(settings, 300) == (0.05, 0.4)
    assert ppo.deviation_bounds(settings, 350) == (0.05, 0.2)
    some = training(initial_std=0.2, std_end=0.2, restart=Restart(after=16 * 8 + 1, std=0.4, half_life=10**9))
    found = []
    for _ in range(4):
        some.update()
        found.append(float(some.model.policy.log_std.exp().detach()))
    assert max(found[:2]) <= 0.2 * (1 + 1e-6)
    assert min(found[2:]) > 0.35


def test_a_restart_before_the_first_update_is_one() -> None:
    some = training(initial_std=0.2, std_end=0.2, restart=Restart(std=0.4, half_life=10**9))
    some.update()
    assert float(some.model.policy.log_std.exp().detach()) > 0.35


def test_the_statistics_of_observations_are_kept_once_they_are_frozen() -> None:
    some = training(statistics_until=2 * 16 * 8)
    for _ in range(2):
        some.update()
    before = some.model.normalization.arrays()
    some.update()
    after = some.model.normalization.arrays()
    for name in ("observation_mean", "observation_variance", "return_variance"):
        np.testing.assert_array_equal(before[name], after[name])


def test_what_a_rollout_saw_moves_the_normalisation_of_the_next_one_and_nothing_of_its_own() -> None:
    some = training()
    for _ in range(3):
        before = some.model.normalization.arrays()["observation_mean"]
        some.update()
        used, after = some.model.policy.normalizer.mean.numpy(), some.model.normalization.arrays()["observation_mean"]
        np.testing.assert_allclose(used, before, rtol=1e-6)
        assert abs(after - before).max() > 1e-3


def test_the_policy_that_acts_in_a_rollout_is_the_one_that_is_judged() -> None:
    some = training()
    for _ in range(3):
        before = some.model.policy.log_std.detach().clone()
        some.update()
    columns = some.model.samples.columns
    noise = (columns["action"] - columns["mean"]) / before.exp()
    assert abs(float(noise.mean())) < 0.2
    assert 0.8 < float(noise.std()) < 1.2
    expected = log_density(columns["action"], columns["mean"], before)
    torch.testing.assert_close(columns["log_density"], expected)


def test_the_true_divergence_of_an_update_comes_near_the_desired_one() -> None:
    some = training(steps=16 * 8 * 40)
    finish(some)
    kl = np.mean([some.update()["train/kl"] for _ in range(10)])
    assert 0.004 < kl < 0.036
