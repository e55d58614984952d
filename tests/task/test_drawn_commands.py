"""Commands: drawn in their ranges, approached at their rates, played from scripts."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from task_worlds import rollout

from iowbc import counter_random as random
from iowbc.control.command import COMMAND, HEIGHT, OFFSET, PITCH, VELOCITY, approach, nominal_command, rate_limits
from iowbc.recipe.task.commands import CommandRates, Commands
from iowbc.recipe.task.curriculum import Curriculum
from iowbc.task.commands import draw_goals, draw_holding_time
from iowbc.task.curriculum import difficulty
from iowbc.task.episodes import CommandScript, CommandSegment
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
COMMANDS = Commands()


def goals(level: float, count: int = 4000, *, pushing: bool = False, commands: Commands = COMMANDS) -> Any:
    key = random.environment_key(0, np.arange(count))
    hardness = difficulty(Curriculum(), np.full((count, 4), level))
    return draw_goals(commands, key, hardness, pushing=np.full(count, pushing), walking=np.ones(count, bool))


def test_goals_at_level_one_fill_the_recipes_ranges_and_do_not_leave_them() -> None:
    drawn = goals(1.0, commands=COMMANDS.model_copy(update={"deep_share": 0.0, "smallest_speed": 0.0}))
    ranges = (COMMANDS.velocity_x, COMMANDS.velocity_y, COMMANDS.yaw_rate, COMMANDS.height, COMMANDS.pitch)
    for column, (low, high) in enumerate(ranges):
        values = drawn[:, column]
        assert low - 1e-9 <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high + 1e-9
    largest = np.abs(drawn[:, OFFSET]).max(axis=0)
    assert (largest <= np.tile(np.add(COMMANDS.common_offset, COMMANDS.single_offset), 2) + 1e-9).all()


def test_the_shares_of_standing_straight_and_nominal_commands_are_the_recipes() -> None:
    drawn = goals(1.0)
    standing = ~drawn[:, VELOCITY].any(axis=1)
    walking = drawn[~standing]
    straight = ~walking[:, 1:3].any(axis=1)
    turning = ~walking[~straight, :2].any(axis=1)
    drawn = goals(1.0, commands=COMMANDS.model_copy(update={"deep_share": 0.0}))
    nominal = (drawn[:, HEIGHT:] == nominal_command(COMMANDS)[HEIGHT:]).all(axis=1)
    for found, share in (
        (standing, COMMANDS.standing_share),
        (straight, COMMANDS.straight_share),
        (turning, COMMANDS.turning_share),
        (nominal, COMMANDS.nominal_share),
    ):
        assert found.mean() == pytest.approx(share, abs=0.03)


def test_walking_goals_are_worth_a_step() -> None:
    drawn = goals(1.2)
    speed = np.hypot(drawn[:, 0], drawn[:, 1])
    assert speed[speed > 0].min() >= COMMANDS.smallest_speed - 1e-9


def test_behind_a_crate_nobody_walks_backward_or_to_the_side_and_turns_are_slow() -> None:
    drawn = goals(1.0, pushing=True)
    assert drawn[:, 0].min() >= 0.0
    assert not drawn[:, 1].any()
    assert np.abs(drawn[:, 2]).max() <= COMMANDS.pushing.yaw_rate[1]


def test_deep_leans_reach_the_papers_range_and_stand() -> None:
    drawn = goals(1.0)
    low, high = COMMANDS.pitch
    deep = (drawn[:, PITCH] < low) | (drawn[:, PITCH] > high)
    assert 0.005 < deep.mean() < COMMANDS.deep_share
    assert drawn[deep, PITCH].max() > 1.3
    assert not drawn[deep][:, VELOCITY].any()


def test_turns_on_the_spot_are_worth_a_step() -> None:
    drawn = goals(0.0)
    turns = drawn[~drawn[:, :2].any(axis=1), 2]
    assert np.abs(turns[turns != 0.0]).min() >= COMMANDS.smallest_yaw_rate


def test_at_the_start_of_the_curriculum_most_walk_and_postures_are_near_nominal() -> None:
    drawn = goals(0.0)
    assert 0.8 < drawn[:, VELOCITY].any(axis=1).mean() < 0.9
    nominal = nominal_command(COMMANDS)
    reach = 0.2 * max(nominal[HEIGHT] - COMMANDS.height[0], COMMANDS.height[1] - nominal[HEIGHT])
    assert np.abs(drawn[:, HEIGHT] - nominal[HEIGHT]).max() <= reach + 1e-9


def test_holding_times_are_drawn_from_their_range() -> None:
    held = draw_holding_time(COMMANDS, random.environment_key(0, np.arange(500)))
    low, high = COMMANDS.resampling
    assert low <= held.min() < held.max() <= high
    assert held.mean() == pytest.approx((low + high) / 2, abs=0.2)


def test_a_command_approaches_its_goal_at_the_rate_limit_and_stops_there() -> None:
    step = rate_limits(CommandRates(velocity=1.0)) * 0.02
    command, goal = np.zeros((1, 11)), np.zeros((1, 11))
    goal[0, 0] = 0.05
    walked = []
    for _ in range(4):
        command = approach(command, goal, step)
        walked.append(command[0, 0])
    assert walked == pytest.approx([0.02, 0.04, 0.05, 0.05])


def test_commands_in_training_respect_their_rates_and_change_in_time(make: Make) -> None:
    changes = {"task.curriculum.enabled": False, "task.commands.resampling": (0.2, 0.4), "task.scenes.lift": 0.0}
    env = make(num_envs=8, changes=changes | {"task.episode_duration": (5.0, 5.0)})
    env.reset()
    seen = rollout(env, 30, size=0.0)
    assert not seen["done"].any()
    rates = COMMANDS.rates
    for name, limits in (
        ("commanded_velocity", [rates.velocity, rates.velocity, rates.yaw_rate]),
        ("height_command", [rates.height]),
        ("torso_pitch_command", [rates.pitch]),
    ):
        change = np.abs(np.diff(seen[name], axis=0)).max(axis=(0, 1))
        assert (change <= np.array(limits) * 0.02 + 1e-9).all()
        assert change.max() > 0.0


def test_a_drawn_episode_starts_standing(make: Make) -> None:
    env = make(num_envs=8, changes={"task.curriculum.enabled": False})
    env.reset()
    assert not env.signals["commanded_velocity"].any()


def test_a_script_ramps_and_holds() -> None:
    one, two = np.zeros(11), np.zeros(11)
    one[0], two[0] = 0.2, 0.6
    script = CommandScript((CommandSegment(1.0, tuple(one)), CommandSegment(2.0, tuple(two), 0.5)))
    times = (0.0, 0.5, 1.0, 1.25, 1.5, 3.0, 9.0)
    assert [script.at(time)[0] for time in times] == pytest.approx([0.2, 0.2, 0.2, 0.4, 0.6, 0.6, 0.6])
    assert script.duration == 3.0


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        ({"duration": 1.0, "command": (0.0,) * 10}, "11 values .* got 10"),
        ({"duration": 1.0, "command": (np.nan,) * 11}, "finite"),
        ({"duration": 1.0, "command": (0.0,) * 11, "ramp": 2.0}, "between 0 and the duration of 1.0 s, got 2.0 s"),
    ],
)
def test_impossible_segments_are_refused(segment: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CommandSegment(**segment)


def test_a_command_has_eleven_entries_in_the_papers_order() -> None:
    assert len(COMMAND) == 11
    assert COMMAND[:5] == ("v_x", "v_y", "yaw_rate", "height", "pitch")
    assert (COMMAND[HEIGHT], COMMAND[PITCH], COMMAND[OFFSET][0]) == ("height", "pitch", "left_x")


def test_an_episode_with_a_held_object_begins_on_the_way_to_its_posture(make: Make) -> None:
    env = make(num_envs=40, changes={"task.commands.nominal_share": 0.0, "task.commands.holding_start": 0.4})
    env.reset()
    memory, holding = env.batch.memory, env.batch.scenes == "lift"
    part = memory.command[:, OFFSET] / memory.goal[:, OFFSET]
    assert part[holding] == pytest.approx(0.4)
    assert part[~holding] == pytest.approx(1.0)
