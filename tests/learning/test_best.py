"""A training keeps its best policy and survives its own mistakes."""

from typing import Any

import numpy as np
import pytest
import torch
from point_masses import MIRRORS, PointMasses

from iowbc.errors import StageFailed
from iowbc.learning.acting import Policy, TeacherPolicy
from iowbc.learning.networks import TeacherNetwork
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Check, Teacher

CHECK = Check(every=1, rollbacks=2, patience=1)


class Scores:
    """Scores that a training is told, whatever it has learnt; it remembers what was scored."""

    def __init__(self, *scores: float) -> None:
        self.scores = list(scores)
        self.networks: list[TeacherNetwork] = []

    def __call__(self, policy: Policy) -> dict[str, float]:
        assert isinstance(policy, TeacherPolicy)
        self.networks.append(policy.network)
        return {"score": self.scores[len(self.networks) - 1]}


def training(scores: Scores | None, **changes: Any) -> tuple[TeacherTraining, list[str]]:
    lines: list[str] = []
    settings = Teacher(environments=8, rollout=16, minibatches=2, hidden=(16,), check=CHECK)
    some = TeacherTraining(
        Learner(settings.model_copy(update=changes), PointMasses(), MIRRORS, 3), score=scores, say=lines.append
    )
    return some, lines


def same(one: TeacherNetwork, other: TeacherNetwork) -> bool:
    theirs = other.state_dict()
    return all(torch.equal(value, theirs[name]) for name, value in one.state_dict().items())


def test_what_scored_best_is_kept_though_the_training_went_on() -> None:
    scores = Scores(0.5, 0.6, 0.55, 0.55)
    some, _ = training(scores)
    for _ in range(3):
        some.update()
    some.keep_best()
    assert same(some.network()[0], scores.networks[1])


def test_the_last_policy_is_kept_where_it_scores_best() -> None:
    scores = Scores(0.5, 0.7)
    some, _ = training(scores, check=CHECK.model_copy(update={"every": 2}))
    for _ in range(3):
        some.update()
    last = some.network()[0]
    some.keep_best()
    assert same(some.network()[0], last)


def test_a_score_that_falls_by_a_third_brings_the_best_policy_back_with_smaller_steps() -> None:
    scores = Scores(0.6, 0.5, 0.39, 0.6)
    some, lines = training(scores)
    for _ in range(2):
        some.update()
    rate = some.model.learning_rate
    some.update()
    assert same(some.network()[0], scores.networks[0])
    assert lines == [
        "the score fell from 0.600 to 0.390 at 384 steps: goes back to the best policy, with smaller steps"
    ]
    assert some.model.learning_rate < 0.75 * rate
    assert some.update()["rollbacks"] == 0.0, "a policy as good as the best ends the count"
    assert some.best.caution == 0.5


def test_a_collapse_halves_a_constant_learning_rate_below_the_range_too() -> None:
    some, _ = training(Scores(0.6, 0.1), desired_kl=None, learning_rate=1e-5)
    for _ in range(2):
        some.update()
    assert some.model.learning_rate == pytest.approx(0.5e-5)


def test_only_low_scores_in_a_row_are_a_collapse_across_an_interruption_too() -> None:
    patient = CHECK.model_copy(update={"patience": 2})
    some, lines = training(Scores(0.6, 0.1, 0.5, 0.1), check=patient)
    for _ in range(4):
        some.update()
    assert lines == []
    resumed, more = training(Scores(0.1), check=patient)
    resumed.restore(some.arrays())
    resumed.update()
    assert "the score fell from 0.600 to 0.100" in more[0]


def test_low_scores_at_the_beginning_are_no_collapse() -> None:
    some, lines = training(Scores(0.15, 0.05, 0.1))
    for _ in range(3):
        some.update()
    assert lines == []


def test_networks_that_diverge_are_brought_back_and_their_figures_not_told() -> None:
    some, lines = training(None)
    some.update()
    with torch.no_grad():
        some.model.policy.critic.last.even.weight.fill_(float("nan"))
    figures = some.update()
    assert all(np.isfinite(value) for value in figures.values())
    assert "the networks diverged at 256 steps" in lines[0]
    assert some.model.policy.finite()
    some.update()
    assert len(lines) == 1


def test_exploration_that_died_out_is_brought_back() -> None:
    some, lines = training(None)
    with torch.no_grad():
        some.model.policy.log_stds.fill_(np.log(0.05))
    some.update()
    assert "exploration died out" in lines[0]
    assert float(some.model.policy.log_stds.exp().mean().detach()) == pytest.approx(0.5)


def test_a_floor_near_the_end_of_the_annealing_is_meant_to_be_reached() -> None:
    some, lines = training(None, std_floor=0.15)
    with torch.no_grad():
        some.model.policy.log_stds.fill_(np.log(0.15))
    some.update()
    assert lines == []


def test_a_training_that_collapses_again_and_again_gives_up_and_says_what_to_lower() -> None:
    some, _ = training(Scores(0.6, 0.1, 0.1, 0.1))
    for _ in range(3):
        some.update()
    with pytest.raises(
        StageFailed, match=r"fell from 0\.600 to 0\.100.*rollbacks \(2\) are used up.*teacher\.desired_kl"
    ):
        some.update()


def test_what_scored_best_survives_an_interruption() -> None:
    scores = Scores(0.5, 0.6, 0.55)
    some, _ = training(scores)
    for _ in range(3):
        some.update()
    resumed, _ = training(Scores(0.4))
    resumed.restore(some.arrays())
    resumed.keep_best()
    assert same(resumed.network()[0], scores.networks[1])
