"""What an exported controller must do to be accepted, on trials whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_trials import DT, RECIPE, ROBOT, outcome, script, trace

from iowbc.evaluation.exported import Accepted, judged
from iowbc.evaluation.trials.rollout import Outcome
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.export import Acceptance
from iowbc.robot.description import GRAVITY
from iowbc.task.episodes import Episode

MASS, STEPS = 4.0, 400
WALK = (0.4, 0.0, 0.0)


def played(
    *, in_hands: float = 1.0, covered: float = 0.0, beside: float = 0.0, fallen: bool = False
) -> tuple[Episode, Outcome]:
    """Eight seconds in which the hands bear part of the weight, the robot covers part of the way, and the object comes
    to be at its side [m]."""
    signals = trace(STEPS)
    grip, path = signals.grip_force.copy(), signals.base_position.copy()
    grip[:, [2, 5]] = -0.5 * in_hands * MASS * GRAVITY
    path[:, 0] = covered * WALK[0] * DT * np.arange(STEPS)
    moved = replace(signals, grip_force=grip, base_position=path, object_position=np.add(path, [0.3, beside, 1.0]))
    commands = script(8.0, WALK if covered else (0.0, 0.0, 0.0))
    return Episode("lift", 0, 8.0, {}, commands), replace(outcome(moved, MASS), ending="fell" if fallen else "finished")


def accepted(*trials: tuple[Episode, Outcome], minimum: int = 1) -> Accepted:
    asked = Acceptance(trials=len(trials), minimum=minimum, sequence=(Segment(duration=8.0),))
    return judged(RECIPE, ROBOT, asked, list(trials))


def test_weight_on_the_thighs_is_not_accepted() -> None:
    found = accepted(played(), played(in_hands=0.9), played(fallen=True), minimum=2)
    assert (found.survived, found.passed, found.enough) == (2, 1, False)
    assert found.weight_in_hands == pytest.approx((1.0 + 0.9 + 1.0) / 3)
    assert "in 2 of 3 trials, 97% of its weight in the hands; 1 passed" in found.sentence


def test_a_statue_is_not_accepted_where_walking_is_asked_for() -> None:
    found = accepted(played(covered=0.9), played(covered=0.2))
    assert (found.survived, found.passed, found.enough) == (2, 1, True)
    assert "55% of the way covered" in found.sentence


def test_who_loses_the_object_at_its_side_is_not_accepted() -> None:
    found = accepted(played(covered=0.9), played(covered=0.9, beside=-0.4))
    assert (found.survived, found.passed) == (2, 1)
