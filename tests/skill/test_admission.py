"""What makes a transport task one for two."""

import pytest

from iowbc.skill.admission import PAIRS, Admission


@pytest.mark.parametrize(
    ("success", "force", "admitted"),
    [
        ((1.0, 0.0, 0.0, 0.5), (12.0, 0.0, 12.0, 14.0), True),
        ((0.6, 0.0, 0.0, 0.5), (12.0, 0.0, 12.0, 14.0), False),
        ((1.0, 0.5, 0.0, 0.5), (12.0, 0.0, 30.0, 14.0), False),
        ((1.0, 0.0, 1.0, 0.5), (12.0, 0.0, 13.0, 14.0), False),
        ((1.0, 0.0, 1.0, 0.5), (12.0, 0.0, 22.0, 14.0), True),
    ],
    ids=["admitted", "unsolved", "solved alone", "solved by standing", "led with more force"],
)
def test_a_robot_that_only_lets_itself_be_led_costs_its_partner_force(
    success: tuple[float, ...], force: tuple[float, ...], admitted: bool
) -> None:
    reward = dict(zip(PAIRS, (4.0, -2.0, 3.0, 3.5), strict=True))
    found = Admission("lift", dict(zip(PAIRS, success, strict=True)), reward, dict(zip(PAIRS, force, strict=True)))
    assert (found.problems == ()) == admitted
