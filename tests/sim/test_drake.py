"""Drake steps the same worlds as MuJoCo: both agree where they must, and all scenes can be played."""

import sys

import numpy as np
import pytest
from changes import changed
from engine_agreement import arm_pendulum, crate_threshold, free_fall, static_load, step_responses, swinging_box
from stepping import run

from iowbc.errors import UsageError
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.recipe import Recipe as WholeRecipe
from iowbc.recipe.section import deciding
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.sim.simulation import Simulation

EXPERIMENTS = (free_fall, arm_pendulum, step_responses, static_load, crate_threshold, swinging_box)
SCENES = ["lift", "free", "push", "tyre", "squeeze"]


@pytest.fixture
def drake(robot, carrying):
    """Makes a simulation that Drake steps, in the carrying posture."""
    pytest.importorskip("pydrake")

    def make(recipe, scenes, settings=None, **fixed):
        n = len(scenes)
        simulation = Simulation(
            robot, recipe, envs=np.arange(n), seed=0, scenes=scenes, fixed=fixed, drake=settings or Drake()
        )
        simulation.reset(np.arange(n), np.tile(carrying, (n, 1)))
        return simulation

    return make


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_the_engines_agree_where_they_must(robot, experiment):
    pytest.importorskip("pydrake")
    rows = experiment(robot)
    for row in rows:
        law = "" if np.isnan(row.law) else f", law {row.law:.4g}"
        print(f"{row.name} [{row.unit}]: MuJoCo {row.engines[0]:.4g}, Drake {row.engines[1]:.4g}{law}")
    assert all(np.isfinite(row.tolerance) for row in rows)
    assert [row for row in rows if not row.agrees] == []


def test_a_missing_drake_is_named_with_its_extra(robot, monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("pydrake", "iowbc.sim.drake"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pydrake", None)
    with pytest.raises(UsageError, match=r"pip install .\.\[drake\]"):
        Simulation(robot, Recipe(), envs=np.zeros(1, np.int64), seed=0, scenes=["free"], drake=Drake())


def test_the_engine_decides_a_key_only_where_it_is_not_the_usual_one():
    usual = WholeRecipe(name="made-up").eval
    assert not {"engine", "drake"} & deciding(usual).keys()
    assert deciding(usual.model_copy(update={"engine": "drake"}))["engine"] == "drake"


def test_every_scene_goes_as_in_mujoco_for_a_while(drake, start, by_hands):
    pair = drake(by_hands, SCENES), start(by_hands, SCENES)
    for simulation in pair:
        run(simulation, 20)
    one, other = (simulation.state for simulation in pair)
    assert not one.diverged.any()
    assert one.joint_position == pytest.approx(other.joint_position, abs=0.05)
    assert one.base_position == pytest.approx(other.base_position, abs=0.01)
    assert one.object_position == pytest.approx(other.object_position, abs=0.02)
    assert one.hand_weight_share == pytest.approx(other.hand_weight_share, abs=0.15)
    assert one.foot_force[..., 2].sum(axis=1) == pytest.approx(other.foot_force[..., 2].sum(axis=1), rel=0.1)
    assert (one.grasped == other.grasped).all()


def test_a_snapshot_continues_bit_for_bit(drake):
    simulation = drake(Recipe(), ["lift", "push"])
    run(simulation, 5)
    saved = simulation.snapshot()
    run(simulation, 5)
    expected = {name: values.copy() for name, values in vars(simulation.state).items()}
    other = drake(Recipe(), ["lift", "push"])
    other.restore(saved)
    run(other, 5)
    assert all(np.array_equal(expected[name], values) for name, values in vars(other.state).items())


def test_motors_follow_their_targets_as_late_as_drawn(drake, calm):
    recipe = changed(calm, "physics.body_contact", "nothing")
    simulation = drake(recipe, ["free"] * 2, action_latency=np.array([0.0, 1.0]))
    start = simulation.state.joint_position.copy()
    simulation.target[:, 12] += 0.1
    simulation.step()
    moved = np.abs(simulation.state.joint_position - start)[:, 12]
    assert moved[0] > 10.0 * moved[1]


def test_bodies_that_the_model_excludes_do_not_touch(drake, calm):
    simulation = drake(changed(calm, "physics.body_contact", "everything"), ["free"])
    run(simulation, 5)
    (environment,) = simulation.worlds[0]._environments
    found = environment._contacts.Eval(environment.context)
    contacts = [found.point_pair_contact_info(place) for place in range(found.num_point_pair_contacts())]
    bodies = [environment.plant.tree.get_body(contact.bodyB_index()).name() for contact in contacts]
    assert contacts
    assert not [name for name in bodies if "wrist" in name or "hip" in name], bodies


def test_a_grip_lets_go_above_its_slip_force(drake, calm):
    simulation = drake(calm, ["lift"] * 2, surface_friction=np.array([0.05, 1.0]))
    run(simulation, 50)
    assert not simulation.state.grasped[0].any()
    assert simulation.state.grasped[1].all()


def test_torques_stay_within_the_limits_of_the_motors(drake, calm):
    simulation = drake(calm, ["free"])
    simulation.target[:] += 1.0
    run(simulation, 3)
    state = simulation.state
    assert state.saturation.any()
    assert (np.abs(state.joint_torque) <= state.torque_limit / 0.999 + 1e-9).all()
