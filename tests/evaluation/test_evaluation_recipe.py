"""What the evaluation and export sections of a recipe accept."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.evaluation.suites import Compliance, HeavyCase, MassSweep, PushLadder
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import HOLDABLE, SCENES
from iowbc.recipe.simulation.simulation import SimulationSettings as SimulationRecipe
from iowbc.recipe.task.joint_references import Grasps
from iowbc.robot.description import load_robot, robot_folder
from iowbc.sim.simulation import Simulation


def test_the_quickstart_question_can_be_asked() -> None:
    question = Evaluation(
        sequence=(Segment(duration=10.0, ramp=0.0),),
        lifting=MassSweep(scene="lift", masses=(4.0,), partner_shares=(0.0,)),
        trials=5,
    )
    assert sum(segment.duration for segment in question.sequence) == 10.0
    assert Acceptance(mass=4.0, trials=5, minimum=4).minimum == 4


@pytest.mark.parametrize("masses", [(), (4.0, 2.0), (1.0, 1.0), (-1.0,)])
def test_masses_must_ascend_from_zero(masses: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError, match="masses"):
        MassSweep(masses=masses)


def test_an_object_needs_a_scene_that_has_one() -> None:
    for section in (MassSweep, Acceptance):
        with pytest.raises(ValidationError, match="a mass of 0 is without one"):
            section(scene="free")


def test_heavy_cases_of_one_name_are_refused() -> None:
    case = HeavyCase(name="tyre", scene="tyre", mass=18.0)
    with pytest.raises(ValidationError, match="tyre is the name of more than one case"):
        Evaluation(heavy=(case, case.model_copy(update={"mass": 20.0})))


def test_an_evaluation_of_nothing_is_refused() -> None:
    with pytest.raises(ValidationError, match="nothing to evaluate"):
        Evaluation(lifting=None)
    Evaluation(lifting=None, heavy=(HeavyCase(name="tyre", scene="tyre", mass=18.0),))


def test_a_partners_share_is_asked_for_once() -> None:
    with pytest.raises(ValidationError, match=r"partner_shares\n.*must differ"):
        MassSweep(partner_shares=(0.5, 0.5))


def test_pushes_grow() -> None:
    with pytest.raises(ValidationError, match="ascend"):
        PushLadder(impulses=(20.0, 10.0))


def test_a_ramp_longer_than_its_segment_is_refused() -> None:
    with pytest.raises(ValidationError, match="longer than the segment"):
        Segment(duration=1.0, ramp=2.0)


@pytest.mark.parametrize("height", [0.1, 1.2])
def test_a_height_out_of_reach_is_refused(height: float) -> None:
    with pytest.raises(ValidationError, match=r"height\n.*(greater than or equal to 0.3|less than or equal to 1)"):
        Segment(duration=1.0, height=height)
    assert Segment(duration=1.0, height=0.3).height == 0.3


@pytest.mark.parametrize("offset", [0.6, -3.0])
def test_wrists_out_of_reach_are_refused(offset: float) -> None:
    with pytest.raises(ValidationError, match=r"wrists.4\n.*(greater than or equal to -0.5|less than or equal to 0.5)"):
        Segment(duration=1.0, wrists=(0, 0, 0, 0, offset, 0))
    assert Segment(duration=1.0, wrists=(0, 0, 0, 0, 0, -0.5)).wrists[5] == -0.5


DELAY = {"low": 0.05, "nominal": 0.15}


def test_unknown_scenes_and_quantities_are_named_with_what_is_valid() -> None:
    with pytest.raises(ValidationError, match="no scene 'lft' with an object; valid: lift"):
        Recipe(name="x", eval=Evaluation(lifting=MassSweep(scene="lft")))
    with pytest.raises(ValidationError, match=r"no randomised quantity friction; valid: .*ground_friction"):
        MassSweep(fixed={"friction": 1.0})


def test_what_may_be_held_is_what_the_simulation_draws() -> None:
    robot = load_robot(robot_folder("g1"))
    simulation = Simulation(robot, SimulationRecipe(), envs=np.arange(1), seed=0, scenes=["lift"])
    follows_from_others = {"slip_force", "rolling_resistance", "grip_shift"}
    suites_fields = {"object_mass", "object_mass_scale", "partner_share"}
    assert set(HOLDABLE) == set(simulation.drawn) - follows_from_others - suites_fields


@pytest.mark.parametrize(
    ("held", "text"),
    [
        ({"kp_scale": -1.0}, "kp_scale: -1 should be 0 or more"),
        ({"link_mass_scale": 0.0}, "link_mass_scale: 0 should be positive"),
        ({"partner_behaviour": 1.5}, "partner_behaviour: 1.5 is no behaviour; valid: path, follower"),
        ({"object_mass": 4.0}, "no randomised quantity object_mass; .* mass and partner_share are fields of their own"),
        ({"partner_share": 0.3}, "no randomised quantity partner_share"),
    ],
)
def test_what_no_trial_could_hold_is_refused(held: dict[str, float], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        MassSweep(fixed=held)
    MassSweep(fixed={"gyro_bias": -0.01, "stopping_reverse": -0.5, "object_com_offset_y": -0.1})


@pytest.mark.parametrize(
    "given",
    [
        {"masses": [4, 4]},
        {"behaviours": ["path", "path"]},
        {"partner_shares": [0.5, 0.5]},
        {"impedance": {"directions": ["x", "x"]}},
        {"impedance": {"frequencies": [1, 1]}},
    ],
)
def test_what_would_count_trials_twice_is_refused(given: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="must differ, or trials would count more than once"):
        Compliance.model_validate(given)


def test_a_push_after_the_end_of_its_trial_is_refused() -> None:
    """The robot would survive every impulse."""
    with pytest.raises(ValidationError, match=r"time: a push from 8 to 8.1 s is not within the 8 s"):
        PushLadder(time=8.0)
    PushLadder(time=7.0, duration=1.0)


def test_a_delay_held_beyond_the_simulations_delay_lines_is_refused() -> None:
    late, later = {"name": "late", "fixed": {"sensor_latency": 5.0}}, {"name": "later", "fixed": {"partner_delay": 0.7}}
    given: dict[str, Any] = {"name": "x", "eval": {"heavy": [late], "robustness": {"cases": [later]}}}
    with pytest.raises(ValidationError) as refused:
        Recipe.model_validate(given)
    assert "eval.heavy.0.fixed: sensor_latency: 5 is above 4, simulation.randomization.longest" in str(refused.value)
    assert "eval.robustness.cases.0.fixed: partner_delay: 0.7 is above 0.6, the longest of" in str(refused.value)
    given["eval"]["simulation"] = {
        "randomization": {"longest_latency": 5},
        "partner": {"delay": {**DELAY, "high": 0.7}},
    }
    Recipe.model_validate(given)


def test_every_scene_has_a_base_grasp() -> None:
    assert set(SCENES) == set(Grasps.model_fields)


def test_a_minimum_above_the_trials_is_refused() -> None:
    with pytest.raises(ValidationError, match="exceeds"):
        Acceptance(trials=3, minimum=4)
