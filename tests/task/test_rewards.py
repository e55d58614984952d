"""The terms of the reward, by worked examples."""

from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from changes import changed
from pydantic import ValidationError
from task_worlds import QUIET, rollout

from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.reward import Kernel, Reward, Smoothness
from iowbc.task.rewards import reward, terms
from iowbc.task.rewards.reward import RewardFunction, kernel
from iowbc.task.rewards.table import TERMS, Step
from iowbc.task.rewards.terms import squared_norm
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]


def term(path: str, **step: Any) -> Any:
    """A term of the table for a step that has these parts alone."""
    return TERMS[path](SimpleNamespace(**step))  # type: ignore[arg-type]


def test_a_kernel_is_one_without_error_and_falls_to_37_percent_at_its_width() -> None:
    assert kernel(np.array([0.0, 0.25**2]), 0.25) == pytest.approx([1.0, np.exp(-1.0)])


def test_the_papers_two_terms_of_synchronisation() -> None:
    error = np.zeros((1, 15))
    error[0, :2] = 0.3, 0.4
    assert term("sync.support_reference", support_error=error) == pytest.approx([0.25])
    velocity, target = np.array([[0.3, 0.1, 0.0]]), np.array([[0.3, -0.1]])
    found = term("sync.system_velocity", filtered_velocity=velocity, target_velocity=target)
    assert found == pytest.approx([0.04])


def test_power_counts_braking_like_driving() -> None:
    torque, velocity = np.array([[2.0, -3.0]]), np.array([[1.0, 2.0]])
    assert terms.power(torque, velocity)[0] == 8.0


def test_action_rate_and_base_rates() -> None:
    assert term("smooth.action_rate", action=np.array([[1.0, 2.0]]), previous_action=np.zeros((1, 2)))[0] == 5.0
    turning = SimpleNamespace(base_angular_velocity=np.array([[1.0, 2.0, 9.0]]))
    assert term("smooth.base_rates", state=turning)[0] == 5.0
    rising = SimpleNamespace(base_velocity=np.array([[9.0, 9.0, 0.3]]))
    assert term("smooth.vertical_velocity", motion=rising, height_rate=np.array([0.1]))[0] == pytest.approx(0.04)
    assert terms.saturation(np.array([[True, False, False, False]]))[0] == 0.25


def test_the_object_costs_nothing_where_none_is_held() -> None:
    away, place, held = np.array([[0.1, 0.2, 0.2]] * 2), np.zeros((2, 3)), np.array([True, False])
    offset = SimpleNamespace(object_offset=away)
    assert term("object.position", motion=offset, object_place=place, held=held) == pytest.approx([0.09, 0.0])
    angle = 0.3
    tilted = np.array([[np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0]] * 2)
    assert terms.tilt(tilted, held) == pytest.approx([np.sin(angle) ** 2, 0.0])
    rising = SimpleNamespace(object_linear_velocity=np.array([[0.0, 0.0, 0.3]] * 2))
    found = term("object.vertical_velocity", state=rising, height_rate=np.full(2, 0.1), held=held)
    assert found == pytest.approx([0.04, 0.0])


def test_what_rests_on_other_links_than_the_hands_costs_by_its_force_within_bounds() -> None:
    force = SimpleNamespace(link_object_force=np.array([0.0, 50.0, 5000.0]))
    most = Reward().object.largest_link_contact
    assert term("object.link_contact", state=force, recipe=Reward()).tolist() == [0.0, 50.0, most]


def test_a_pushed_object_costs_by_how_far_it_is_beside_the_hands_up_to_where_it_is_lost() -> None:
    away = np.array([[0.8, 0.1, 0.0], [1.4, -0.1, 0.3], [0.8, 2.0, 0.0], [0.8, 0.1, 0.0]])
    place = np.array([[0.8, -0.1, 0.1]] * 4)
    pushed = np.array([True, True, True, False])
    assert terms.beside(away, place, 0.5, pushed) == pytest.approx([0.04, 0.0, 0.25, 0.0])


def test_an_object_that_only_turns_about_the_vertical_is_level() -> None:
    turned = np.array([[np.cos(0.4), 0.0, 0.0, np.sin(0.4)]])
    assert terms.tilt(turned, np.array([True]))[0] == pytest.approx(0.0)


def test_a_sole_that_sinks_near_the_ground_costs_and_one_that_rises_or_is_high_does_not() -> None:
    height = np.array([[0.0, 0.02], [0.0, 0.0], [1.0, 1.0]])
    velocity = np.array([[-0.8, -0.8], [0.8, 0.0], [-0.8, -0.8]])
    cost = terms.touchdown(height, velocity, 0.02)
    assert cost == pytest.approx([0.64 * (1.0 + np.exp(-1.0)), 0.0, 0.0], abs=1e-9)


def test_the_second_difference_of_the_action_is_zero_for_a_steady_change() -> None:
    actions = np.array([[0.3], [0.1]]), np.array([[0.2], [-0.1]]), np.array([[0.1], [0.1]])
    names = ("action", "previous_action", "earlier_action")
    found = term("smooth.action_curvature", **dict(zip(names, actions, strict=True)))
    assert found == pytest.approx([0.0, 0.16])


def test_torque_costs_beyond_the_comfortable_part_of_its_limit() -> None:
    torque, limit = np.array([[10.0, -45.0, 3.0]]), np.array([[50.0, 50.0, 0.0]])
    assert terms.effort(torque, limit, 0.5) == pytest.approx([0.4**2 + 2.5**2])


def test_weights_of_a_robot_that_walks_take_over_with_its_level(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = Reward.model_validate(
        {"alive": 0.5, "later": {"begin": 0.5, "end": 1.0, "weights": {"alive": 1.5, "termination": -25.0}}}
    )
    table = {path: (lambda step: np.zeros(4)) for path in TERMS} | {
        "alive": lambda step: np.ones(4),
        "termination": lambda step: np.array([0.0, 0.0, 0.0, 1.0]),
    }
    step = SimpleNamespace(command=np.zeros((4, 11)))
    level, none = np.array([0.2, 0.75, 1.0, 2.0]), np.zeros(4, bool)
    monkeypatch.setattr(reward, "TERMS", table)
    found = RewardFunction(recipe, 0.02)(step, none, level)[0]  # type: ignore[arg-type]
    column = list(TERMS).index
    assert found[:, column("alive")] == pytest.approx([0.01, 0.02, 0.03, 0.03])
    assert found[:, column("termination")] == pytest.approx([0.0, 0.0, 0.0, -25.0])


def test_a_later_weight_of_no_term_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"no term 'sync.speed'; valid: alive, gait.contact_timing"):
        Reward.model_validate({"later": {"weights": {"sync.speed": 1.0}}})


def test_later_weights_may_name_every_term_and_no_parameter_of_one() -> None:
    given = {"yielding": {"held": 60.0, "pushed": 280.0}, "later": {"weights": dict.fromkeys(TERMS, 1.0)}}
    RewardFunction(Reward.model_validate(given), 0.02)
    for parameter in ("smooth.comfortable_effort", "gait.touchdown_height", "yielding.held"):
        with pytest.raises(ValidationError, match=f"later.weights: no term '{parameter}'"):
            Reward.model_validate({**given, "later": {"weights": {parameter: 1.0}}})


def test_progress_counts_along_the_command_and_no_faster_than_it() -> None:
    command = np.array([[0.3, 0.4]] * 4 + [[0.0, 0.0]])
    velocity = np.array([[0.0, 0.0], [0.15, 0.2], [0.6, 0.8], [0.8, -0.6], [1.0, 1.0]])
    assert terms.progress(velocity, command) == pytest.approx([0.0, 0.25, 0.5, 0.0, 0.0])
    assert terms.progress(-velocity, command)[2] == pytest.approx(-0.5)
    assert terms.turning(np.array([0.1, 0.9, -0.1]), np.array([0.4, 0.4, -0.4])) == pytest.approx([0.1, 0.4, 0.1])


def test_the_reward_of_progress_has_the_same_slope_from_standing_to_the_command() -> None:
    command, slow, fast = np.array([[0.4, 0.0]]), np.array([[0.05, 0.0]]), np.array([[0.35, 0.0]])
    step = np.array([[0.01, 0.0]])
    slopes = [(terms.progress(v + step, command) - terms.progress(v, command))[0] for v in (0 * slow, slow, fast)]
    assert slopes == pytest.approx([0.01] * 3)


def test_feet_off_the_ground_count_only_while_the_command_is_to_stand() -> None:
    contact = np.array([[True, False], [False, False], [True, False]])
    state = SimpleNamespace(foot_contact=contact)
    assert term("gait.standing", state=state, stepping=np.array([False, False, True])).tolist() == [1.0, 2.0, 0.0]


def test_contact_timing_counts_from_minus_one_to_one() -> None:
    contact = np.array([[True, True], [True, True], [False, False]])
    expected = np.array([[True, True], [True, False], [True, True]])
    assert terms.contact_timing(contact, expected).tolist() == [1.0, 0.0, -1.0]


def test_steps_count_against_the_robot_where_no_velocity_is_commanded() -> None:
    stepping, commanded = np.array([True, True, False]), np.array([True, False, False])
    assert term("gait.recovery", stepping=stepping, commanded=commanded).tolist() == [False, True, False]


def test_a_foot_on_its_swing_profile_scores_one_and_a_standing_foot_nothing() -> None:
    height, profile = np.array([[0.08, 0.0]]), np.array([[0.08, 0.0]])
    one, none = np.array([[True, False]]), np.array([[False, False]])
    assert kernel(terms.swing_height(height, profile, one), 0.04)[0] == pytest.approx([1.0, 0.0])
    assert kernel(terms.swing_height(height, profile, none), 0.04)[0].tolist() == [0.0, 0.0]


def test_slipping_counts_by_the_weight_on_the_foot_and_feet_too_close_cost() -> None:
    velocity = np.array([[[0.3, 0.4, 9.0], [1.0, 0.0, 0.0]]])
    for left, right, expected in ((300.0, 0.0, 0.5), (300.0, 100.0, 0.625), (0.0, 0.0, 0.0), (300.0, -5.0, 0.5)):
        force = np.array([[[7.0, 0.0, left], [7.0, 0.0, right]]])
        assert terms.foot_slip(velocity, force)[0] == pytest.approx(expected)
    feet = np.array([[[0.0, 0.05, 0.0], [0.0, -0.05, 0.0]], [[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]]])
    assert terms.foot_distance(feet, 0.16) == pytest.approx([0.0036, 0.0])


def test_every_weight_of_the_recipe_moves_its_own_term_and_no_other(make: Make) -> None:
    base = make(num_envs=2, changes=QUIET)
    base.reset()
    rollout(base, 10)
    before = base.statistics()
    doubled = make(num_envs=2, changes=QUIET | {"task.reward.sync.height.weight": 2 * Reward().sync.height.weight})
    doubled.reset()
    rollout(doubled, 10)
    after = doubled.statistics()
    for term in TERMS:
        name = f"reward/{term}"
        factor = 2.0 if term == "sync.height" else 1.0
        assert after[name] == pytest.approx(factor * before[name]), name


@pytest.mark.parametrize("scene", ["free", "lift", "push"])
def test_only_what_is_pushed_can_be_beside_the_hands(make: Make, scene: str) -> None:
    scenes = {f"task.scenes.{name}": float(name == scene) for name in ("free", "lift", "push")}
    env = make(num_envs=2, changes=QUIET | scenes | {"task.reward.object.beside": -20.0})
    env.reset()
    rollout(env, 10)
    cost = env.statistics()["reward/object.beside"]
    assert cost < 0.0 if scene == "push" else cost == 0.0


def test_a_fall_costs_its_price_once_and_is_not_scaled_by_the_period(make: Make) -> None:
    env = make(num_envs=4)
    env.reset()
    seen = rollout(env, 100, size=2.0)
    falls = ((seen["fallen"] + seen["dropped"] + seen["lagging"]) > 0).sum()
    figures = env.statistics()
    assert falls > 0
    assert figures["reward/termination"] * 400 * 0.02 == pytest.approx(falls * Reward().termination)


def test_a_new_term_is_a_function_and_a_line_in_the_table(
    recipe: Recipe, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class WithMadeUp(Smoothness):
        made_up: float = 3.0

    def made_up(step: Step) -> Any:
        return np.full(len(step.command), 2.0)

    monkeypatch.setitem(TERMS, "smooth.made_up", made_up)
    env = VectorEnv(
        Specification(changed(recipe, "task.reward.smooth", WithMadeUp()), folder), num_envs=2, workers=0, seed=0
    )
    env.reset()
    rollout(env, 10)
    assert env.statistics()["reward/smooth.made_up"] == pytest.approx(6.0)


def test_a_term_without_weight_is_not_computed_unless_it_says_how_well_the_robot_tracks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    called: list[str] = []
    table = {path: (lambda step, path=path: called.append(path) or np.ones(1)) for path in TERMS}
    weightless = {"weight": 0.0}
    recipe = Reward.model_validate({"alive": 0.0, "sync": {"support_reference": weightless | {"width": 1.0}}})
    recipe = recipe.model_copy(
        update={"sync": recipe.sync.model_copy(update={"height": Kernel(weight=0.0, width=1.0)})}
    )
    monkeypatch.setattr(reward, "TERMS", table)
    RewardFunction(recipe, 0.02)(SimpleNamespace(command=np.zeros((1, 11))), np.array([False]), np.ones(1))  # type: ignore[arg-type]
    idle = {"alive", "sync.support_reference", "sync.lateral_reference", "object.beside", "yielding.force"}
    idle |= {"smooth.action_curvature", "smooth.effort", "gait.touchdown", "gait.recovery"}
    assert set(TERMS) - set(called) == idle


def test_every_number_of_the_recipes_reward_that_is_a_weight_has_its_term() -> None:
    for path in TERMS:
        assert isinstance(attrgetter(path)(Reward()), float | Kernel), path


def test_squared_norm_goes_over_all_but_the_first_axis() -> None:
    assert squared_norm(np.ones((2, 3, 4))).tolist() == [12.0, 12.0]


def test_a_group_left_out_counts_nothing_and_the_others_as_before(make: Make) -> None:
    found = []
    for without in ((), ("gait",)):
        env = make(num_envs=2, changes=QUIET | {"task.reward.without": without})
        env.reset()
        rollout(env, 10)
        found.append(env.statistics())
    before, after = found
    assert any(before[f"reward/{term}"] for term in TERMS if term.startswith("gait."))
    for term in TERMS:
        assert after[f"reward/{term}"] == (0.0 if term.startswith("gait.") else before[f"reward/{term}"]), term
