"""The simulation as a whole: latency, splits over processes, exact continuation, divergence, errors."""

import numpy as np
import pytest
from stepping import run

from iowbc import counter_random as random
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.sim.simulation import Simulation

SCENES = ["lift", "free", "push", "lift", "tyre", "lift"]


def wander(simulation, steps):
    """Steps with targets that move, and returns everything seen."""
    seen, posture = [], simulation.target.copy()
    for step in range(steps):
        simulation.feed[:, :3] = (0.3, 0.05, 0.2)
        phase = 0.2 * step + simulation.envs[:, None]
        simulation.target[:] = posture
        simulation.target[:, :15] += 0.1 * np.sin(phase + np.arange(15))
        simulation.step()
        arrays = {**vars(simulation.state), **vars(simulation.measured)}
        seen.append({name: values.copy() for name, values in arrays.items()})
    return seen


def same(first, second, rows=slice(None)):
    return all(np.array_equal(a[name][rows], b[name]) for a, b in zip(first, second, strict=True) for name in b)


def test_same_numbers_for_any_split_over_processes(start):
    whole = wander(start(Recipe(), SCENES, seed=4), 20)
    for rows in ([0, 1, 2], [3, 4, 5], [5]):
        part = wander(start(Recipe(), [SCENES[row] for row in rows], envs=rows, seed=4), 20)
        assert same(whole, part, rows)


def test_restored_snapshot_continues_bit_for_bit(start):
    simulation = start(Recipe(), SCENES, seed=1)
    wander(simulation, 10)
    saved = simulation.snapshot()
    expected = wander(simulation, 15)
    other = start(Recipe(), SCENES, seed=1)
    wander(other, 3)
    other.restore(saved)
    assert same(expected, wander(other, 15))


def test_restored_snapshot_draws_the_same_next_episode(start, carrying):
    simulation, other = start(Recipe(), SCENES, seed=1), start(Recipe(), SCENES, seed=1)
    wander(simulation, 5)
    other.restore(simulation.snapshot())
    for each in (simulation, other):
        each.reset(np.array([0, 4]), np.tile(carrying, (2, 1)))
    assert all(np.array_equal(simulation.drawn[name], other.drawn[name]) for name in other.drawn)
    assert same(wander(simulation, 5), wander(other, 5))


def test_every_array_of_a_snapshot_has_a_row_an_environment(start):
    for name, values in start(Recipe(), ["lift"] * 5).snapshot().items():
        assert len(values) == 5, name


def test_reseeded_simulation_draws_what_one_made_with_that_seed_draws(start, carrying):
    simulation, other = start(Recipe(), ["lift"] * 2, seed=1), start(Recipe(), ["lift"] * 2, seed=7)
    simulation.reseed(random.environment_key(7, np.arange(2)))
    simulation.reset(np.arange(2), np.tile(carrying, (2, 1)))
    assert all(np.array_equal(simulation.drawn[name], other.drawn[name]) for name in other.drawn)


def test_snapshot_of_other_environments_is_refused(start):
    with pytest.raises(ValueError, match="snapshot of another simulation"):
        start(Recipe(), SCENES).restore(start(Recipe(), SCENES[:3]).snapshot())


def test_resetting_one_environment_leaves_the_others_alone(start, carrying):
    simulation, other = start(Recipe(), SCENES, seed=2), start(Recipe(), SCENES, seed=2)
    wander(simulation, 5), wander(other, 5)
    simulation.reset(np.array([2]), carrying[None])
    rows = np.array([0, 1, 3, 4, 5])
    first, second = wander(simulation, 10), wander(other, 10)
    assert all(np.array_equal(a[name][rows], b[name][rows]) for a, b in zip(first, second, strict=True) for name in a)


@pytest.mark.parametrize("latency", [0, 1, 3])
def test_action_latency_of_n_periods_delays_by_n_periods(start, calm, hold_base, latency):
    hold_base()
    simulation = start(calm, ["free"], action_latency=float(latency))
    run(simulation, 100)
    elbow = simulation.robot.joints.index("left_elbow_joint")
    still = simulation.state.joint_position[0, elbow]
    simulation.target[:, elbow] += 0.3
    run(simulation, latency)
    assert simulation.state.joint_position[0, elbow] == pytest.approx(still, abs=1e-4)
    run(simulation, 1)
    assert simulation.state.joint_position[0, elbow] > still + 0.005


def test_planted_nan_marks_that_environment_alone_and_is_counted(start):
    scenes = ["lift"] * 4
    simulation, healthy = start(Recipe(), scenes, seed=3), start(Recipe(), scenes, seed=3)
    wander(simulation, 5), wander(healthy, 5)
    before = simulation.state.joint_position[2].copy()
    simulation.target[2, 3] = np.nan
    simulation.step()
    healthy.step()
    assert np.array_equal(simulation.state.diverged, [False, False, True, False])
    assert np.array_equal(simulation.state.joint_position[2], before)
    for arrays in (vars(simulation.state), vars(simulation.measured)):
        assert all(np.isfinite(values).all() for values in arrays.values())
    rows = np.array([0, 1, 3])
    expected = vars(healthy.state)
    assert all(np.array_equal(values[rows], expected[name][rows]) for name, values in vars(simulation.state).items())


def test_diverged_environment_lives_on_after_a_reset(start, carrying):
    simulation = start(Recipe(), ["lift"] * 2)
    simulation.target[1] = np.nan
    simulation.step()
    simulation.reset(np.array([1]), carrying[None])
    run(simulation, 10)
    assert not simulation.state.diverged.any()
    assert simulation.state.base_position[1, 2] > 0.6


def test_mujoco_writes_no_log_file(start, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulation = start(Recipe(), ["free"])
    simulation.target[:] = np.nan
    simulation.step()
    assert simulation.state.diverged.all()
    assert not list(tmp_path.iterdir())


def test_unknown_scene_names_the_known_ones(robot):
    with pytest.raises(KeyError, match="no scene 'climb'; there are: free, lift, squeeze, tyre, push"):
        Simulation(robot, Recipe(), envs=np.arange(1), seed=0, scenes=["climb"])


def test_period_that_physics_steps_do_not_fill_is_refused(robot):
    with pytest.raises(ValueError, match=r"no whole number of physics steps of 0\.005"):
        Simulation(robot, Recipe(), envs=np.arange(1), seed=0, scenes=["free"], control_frequency=60.0)
