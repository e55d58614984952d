"""What the evaluation and export sections of a recipe accept."""

import pytest
from pydantic import ValidationError

from iowbc.recipe.evaluation import Evaluation, HeavyCase, Segment, Sweep
from iowbc.recipe.export import Acceptance


def test_the_quickstart_question_can_be_asked() -> None:
    question = Evaluation(
        sequence=(Segment(duration=10.0, ramp=0.0),),
        lifting=Sweep(scene="lift", masses=(4.0,), partner_share=0.0),
        trials=5,
    )
    assert sum(segment.duration for segment in question.sequence) == 10.0
    assert Acceptance(mass=4.0, trials=5, minimum=4).minimum == 4


@pytest.mark.parametrize("masses", [(), (4.0, 2.0), (1.0, 1.0), (-1.0,)])
def test_masses_must_ascend_from_zero(masses: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError, match="masses"):
        Sweep(masses=masses)


def test_an_evaluation_of_nothing_is_refused() -> None:
    with pytest.raises(ValidationError, match="nothing to evaluate"):
        Evaluation(lifting=None)
    Evaluation(lifting=None, heavy=(HeavyCase(name="tyre", scene="tyre", mass=18.0),))


def test_a_ramp_longer_than_its_segment_is_refused() -> None:
    with pytest.raises(ValidationError, match="longer than the segment"):
        Segment(duration=1.0, ramp=2.0)


def test_a_minimum_above_the_trials_is_refused() -> None:
    with pytest.raises(ValidationError, match="exceeds"):
        Acceptance(trials=3, minimum=4)
