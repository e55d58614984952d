"""The Markov game: sizes, endings, and the same course however many workers there are."""

from collections.abc import Callable

import numpy as np
import pytest

from iowbc.errors import UsageError
from iowbc.skill.episodes import Plan
from iowbc.skill.game import GameOutcome, TransportGame

Make = Callable[..., TransportGame]


def actions(game: TransportGame, step: int) -> dict[str, np.ndarray]:
    """Random actions of a step, the same for whoever asks."""
    rng = np.random.default_rng(step)
    return {agent: rng.uniform(-1.0, 1.0, (game.n, size)) for agent, size in game.action_sizes.items()}


def course(game: TransportGame, steps: int) -> list[GameOutcome]:
    game.reset()
    return [game.step(actions(game, step)) for step in range(steps)]


def same(first: GameOutcome, second: GameOutcome) -> bool:
    pairs = [(getattr(first, name), getattr(second, name)) for name in ("reward", "terminated", "truncated")]
    for one, other in ((first.observed, second.observed), (first.final, second.final)):
        pairs += [(one.state, other.state), *zip(one.observations.values(), other.observations.values(), strict=True)]
    figures = [name for name, values in first.figures.items() if values.dtype != object]
    pairs += [(first.figures[name], second.figures[name]) for name in figures]
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


def test_observations_and_state_have_the_sizes_that_the_game_says(make: Make) -> None:
    game = make(n=9)
    seen = game.reset()
    for agent in game.agents:
        assert seen.observations[agent].shape == (9, game.observation_sizes[agent])
        assert np.isfinite(seen.observations[agent]).all()
    assert seen.state.shape == (9, game.state_size)
    assert np.isfinite(seen.state).all()


@pytest.mark.slow
def test_the_course_does_not_depend_on_the_number_of_workers(make: Make) -> None:
    alone, beside = course(make(n=8, workers=0), 14), course(make(n=8, workers=2), 14)
    assert all(same(one, other) for one, other in zip(alone, beside, strict=True))
    assert any(outcome.truncated.any() or outcome.terminated.any() for outcome in alone)


def test_a_reset_begins_the_same_episodes_again_and_another_seed_begins_others(make: Make) -> None:
    game = make(n=3, partners=("agent",))
    first, again = course(game, 3), course(game, 3)
    assert all(same(one, other) for one, other in zip(first, again, strict=True))
    other = make(n=3, partners=("agent",), seed=1)
    assert not np.array_equal(other.reset().state, game.reset().state)


def test_a_game_that_ends_begins_anew_and_hands_over_its_last_observation(make: Make) -> None:
    game = make(n=4)
    for outcome in course(game, 10):
        over = outcome.terminated | outcome.truncated
        assert len(outcome.figures["time"]) == over.sum()
        assert not (outcome.terminated & outcome.truncated).any()
        kept = np.array_equal(outcome.observed.state[~over], outcome.final.state[~over])
        assert kept
        for row in np.flatnonzero(over):
            assert not np.array_equal(outcome.observed.state[row], outcome.final.state[row])
    assert (game.batch._decisions <= 10).all()


def test_the_robot_neither_observes_the_human_nor_a_path_that_it_does_not_know(make: Make) -> None:
    plans = [Plan("lift_corridor", kind, False, mass=8.0, share=0.5, seed=3) for kind in ("path", "leader")]
    plans += [Plan("lift_slalom", "path", False, mass=8.0, share=0.5, seed=3)]
    seen = make(n=3, plans=plans).reset()
    robot, human = seen.observations["robot"], seen.observations["human"]
    assert np.array_equal(robot[0], robot[1])
    assert np.array_equal(robot[0], robot[2])
    assert not np.array_equal(human[0], human[2])
    known = make(n=1, plans=[Plan("lift_corridor", "path", True, mass=8.0, share=0.5, seed=3)]).reset()
    assert not np.array_equal(known.observations["robot"][0], robot[0])


def test_actions_of_the_human_count_where_it_acts_and_nowhere_else(make: Make) -> None:
    plans = [Plan("lift_straight", kind, True, mass=8.0, share=0.5, seed=1) for kind in ("agent", "path")]
    game = make(n=2, plans=plans)
    game.reset()
    assert game.human_acts.tolist() == [True, False]
    still = {agent: np.zeros((2, size)) for agent, size in game.action_sizes.items()}
    ended = []
    for pull in (0.0, -1.0):
        game.reset()
        for _ in range(3):
            outcome = game.step(still | {"human": np.full((2, 5), pull) * [1.0, 0.0, 0.0, 0.0, 0.0]})
        ended.append(outcome.observed.observations["human"][:, :-5])
    assert ended[1][0, 3] < ended[0][0, 3]  # the handle moves backward
    assert np.array_equal(ended[0][1], ended[1][1])


def test_wrong_games_are_refused_with_what_is_known(make: Make) -> None:
    with pytest.raises(UsageError, match=r"lift_strait: no such transport task.*did you mean 'lift_straight'"):
        make(n=1, plans=[Plan("lift_strait", "path", True)])
    with pytest.raises(UsageError, match=r"leder: no such human"):
        make(n=1, partners=("leder",))
    with pytest.raises(UsageError, match=r"1 plans for 2 games"):
        make(n=2, plans=[Plan("lift_straight", "path", True)])
    game = make(n=1)
    game.reset()
    with pytest.raises(ValueError, match=r"actions of human have shape \(1, 4\); expected .* shape \(1, 5\)"):
        game.step({"robot": np.zeros((1, 11)), "human": np.zeros((1, 4))})
