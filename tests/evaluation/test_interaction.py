"""Forces between hands, object and partner, on signals that are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_trials import DT, trace

from iowbc.evaluation.trials.interaction import interaction_metrics, push_metrics
from iowbc.task.record.signals import Trace

WINDOW = 40


def holding(steps: int = 400, **signals: np.ndarray) -> Trace:
    """A trial with an object 0.4 m ahead."""
    return replace(trace(steps), object_position=np.tile([0.4, 0.0, 0.8], (steps, 1)), **signals)


def test_hand_force_is_horizontal_and_that_of_each_hand() -> None:
    grip = np.tile([30.0, 40.0, -500.0, 0.0, 10.0, -500.0], (400, 1))
    grip[7, 3] = 99.0
    metrics = interaction_metrics(holding(grip_force=grip), WINDOW)
    assert metrics["hand_force_mean"] == pytest.approx(50.0), "50 N left, 10 N right"
    assert metrics["hand_force_p95"] == pytest.approx(50.0)
    assert metrics["hand_force_peak"] == pytest.approx(np.hypot(99.0, 10.0))
    assert np.isnan(interaction_metrics(trace(), WINDOW)["hand_force_peak"]), "nothing in the hands"


def test_work_on_the_partner_is_what_a_spring_stores_and_nothing_over_a_cycle() -> None:
    stiffness, time = 200.0, DT * np.arange(400)
    stretch = 0.05 * np.sin(2 * np.pi * time / 2.0)  # four cycles of 2 s in 8 s
    after = 0.05 * np.sin(np.pi * (time + DT))
    force = np.stack([-0.5 * stiffness * (stretch + after), np.zeros(400), np.full(400, 40.0)], axis=1)
    way = np.stack([after - stretch, np.zeros(400), np.full(400, DT)], axis=1)
    whole = holding(partner_force=force, handle_displacement=way)
    assert interaction_metrics(whole, WINDOW)["partner_work"] == pytest.approx(0.0, abs=1e-6), (
        "the weight does not count"
    )
    quarter = holding(25, partner_force=force[:25], handle_displacement=way[:25])
    assert interaction_metrics(quarter, WINDOW)["partner_work"] == pytest.approx(0.5 * stiffness * 0.05**2, rel=0.01)


def test_a_partner_that_is_followed_and_one_that_is_not() -> None:
    force, leading = np.tile([10.0, 0.0, 0.0], (400, 1)), np.tile([0.3, -0.4, 0.1], (400, 1))
    followed = holding(partner_force=force, partner_velocity=leading, handle_displacement=DT * leading)
    assert interaction_metrics(followed, WINDOW)["E_v_partner"] == pytest.approx(0.0, abs=1e-12)
    resisted = holding(partner_force=force, partner_velocity=leading)
    metrics = interaction_metrics(resisted, WINDOW)
    assert metrics["E_v_partner"] == pytest.approx(0.5)
    assert metrics["handle_force_mean"] == metrics["handle_force_peak"] == pytest.approx(10.0)
    alone = interaction_metrics(holding(), WINDOW)
    assert np.isnan([alone["E_v_partner"], alone["handle_force_p95"], alone["partner_work"]]).all()


def pushing(along: float, commanded: float = 1.0, **signals: np.ndarray) -> dict[str, float]:
    """Two feet bear 320 N together; the hands push with a force along y in the last half, which is commanded too."""
    grip, directions = np.zeros((400, 6)), np.zeros((500, 2))
    grip[200:, [1, 4]] = -0.5 * along
    directions[200:, 1] = commanded
    return push_metrics(holding(grip_force=grip, **signals), directions, 10, 0.5, 1000.0, 0.5)


def test_a_push_is_held_against_what_friction_allows() -> None:
    assert pushing(90.0)["push_force"] == pytest.approx(90.0)
    assert pushing(90.0)["push_force_share"] == pytest.approx(1.0, abs=0.03), "80 of 160 N are asked for"
    assert pushing(70.0)["push_force_share"] == 0.0
    assert pushing(-90.0)["push_force_share"] == 0.0, "pulling is no pushing"


def test_a_crate_that_resists_less_than_friction_is_pushed_with_less() -> None:
    signals = holding(grip_force=np.tile([-20.0, 0.0, 0.0, -20.0, 0.0, 0.0], (400, 1)))
    ahead = np.tile([1.0, 0.0], (400, 1))
    assert push_metrics(signals, ahead, 10, 0.5, 60.0, 0.5)["push_force_share"] == 1.0
    assert push_metrics(signals, ahead, 10, 0.5, 100.0, 0.5)["push_force_share"] == 0.0


def test_a_statue_pushes_nothing_and_who_is_not_told_to_push_is_not_measured() -> None:
    assert pushing(0.0) == {"push_force": 0.0, "push_force_share": 0.0}
    assert np.isnan([*pushing(90.0, commanded=0.0).values()]).all()
