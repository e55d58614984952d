"""The multi-agent learner on a game of two agents that is solved in seconds."""

from typing import Any

import numpy as np
import pytest
import torch
from pulling_game import DECISIONS, PullingGame

from iowbc.recipe.skill.learning import SkillLearning
from iowbc.skill.learner import SkillTraining

GAMES, ROLLOUT = 32, 2 * DECISIONS
SETTINGS = SkillLearning(
    steps=48_000,
    imitation_steps=0,
    scripted_steps=16_000,
    games=GAMES,
    rollout=ROLLOUT,
    hidden=(32, 32),
    learning_rate=1e-3,
    value_learning_rate=1e-3,
)


def training(**changes: Any) -> SkillTraining:
    return SkillTraining(SETTINGS.model_copy(update=changes), PullingGame(GAMES), seed=1)


def finish(some: SkillTraining) -> list[dict[str, float]]:
    rows = []
    while some.steps < some.planned:
        rows.append(some.update())
    return rows


def returns(some: SkillTraining, agent_share: float) -> float:
    """Mean return of the mean actions."""
    game = PullingGame(256)
    observed = game.reset(np.arange(256, dtype=np.uint64), agent_share)
    for _ in range(DECISIONS):
        with torch.inference_mode():
            actions = {
                name: agent.network(torch.from_numpy(observed.observations[name])).clamp(-1, 1).numpy()
                for name, agent in some.agents.items()
            }
        outcome = game.step(actions)
        observed = outcome.observed
    return float(np.mean(outcome.figures["return"]))


@pytest.mark.parametrize("algorithm", ["mappo", "happo"])
def test_both_learn_to_pull_to_a_place_that_only_the_human_knows(algorithm: Any) -> None:
    some = training(algorithm=algorithm)
    alone = returns(some, 0.0), returns(some, 1.0)
    finish(some)
    assert returns(some, 0.0) > alone[0] + 0.01, "the robot helps the scripted human"
    assert alone[1] < 0.01, "two who do nothing get nowhere"
    assert returns(some, 1.0) > 0.8


def test_the_robot_alone_learns_with_ppo_and_the_human_stays_as_it_was() -> None:
    some = training(algorithm="ppo", steps=16_000, scripted_steps=0)
    before = {name: value.clone() for name, value in some.agents["human"].network.body.state_dict().items()}
    alone = returns(some, 0.0)
    rows = finish(some)
    assert returns(some, 0.0) > alone + 0.005
    assert not any(name.startswith("learnt/") for row in rows for name in row)
    for name, value in some.agents["human"].network.body.state_dict().items():
        torch.testing.assert_close(value, before[name], rtol=0, atol=0)


def test_the_robots_first_action_is_the_nominal_command() -> None:
    some = training()
    for agent in some.agents.values():
        assert not agent.network(torch.randn(9, agent.architecture["inputs"])).any()


@pytest.mark.parametrize("algorithm", ["mappo", "happo"])
def test_a_resumed_training_ends_bit_for_bit_where_an_unbroken_one_does(algorithm: Any) -> None:
    changes = {"algorithm": algorithm, "steps": 6 * GAMES * ROLLOUT, "scripted_steps": 2 * GAMES * ROLLOUT}
    unbroken = training(**changes)
    finish(unbroken)
    broken = training(**changes)
    for _ in range(3):
        broken.update()
    kept = {name: value.copy() for name, value in broken.arrays().items()}
    torch.manual_seed(99)
    resumed = training(**changes)
    resumed.restore(kept)
    finish(resumed)
    expected, found = unbroken.arrays(), resumed.arrays()
    assert expected.keys() == found.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)
    ended = training(**changes)  # killed after its last checkpoint
    ended.restore(found)
    np.testing.assert_array_equal(ended.golden_observations(2), unbroken.golden_observations(2))


def test_what_the_human_does_in_scripted_games_teaches_it_nothing() -> None:
    some = training(scripted_steps=16_000, steps=16_000)
    finish(some)
    observation = torch.randn(5, 3)
    assert not some.agents["human"].network(observation).any()


def test_a_robot_that_imitates_does_at_once_what_it_cannot_see_is_wanted() -> None:
    some = training(steps=16_000, scripted_steps=16_000, imitation_steps=16_000)
    rows = finish(some)
    assert rows[-1]["train/imitation_error"] < 0.5 * rows[0]["train/imitation_error"]
    assert returns(some, 0.0) > returns(training(), 0.0) + 0.01
    assert not any(name.startswith("robot/") for row in rows for name in row), "nothing is learnt from the reward"


def test_happo_weights_the_second_agent_by_what_the_first_has_changed() -> None:
    some = training(algorithm="happo", scripted_steps=0, learnt_share=1.0)
    some.update()
    together = training(algorithm="mappo", scripted_steps=0, learnt_share=1.0)
    together.update()
    assert float((some._factor - 1.0).abs().max()) > 1e-3
    assert float((together._factor - 1.0).abs().max()) == 0.0


def test_minibatches_must_divide_a_rollout() -> None:
    with pytest.raises(ValueError, match="does not divide"):
        SkillLearning(games=3, rollout=5, minibatches=4)
