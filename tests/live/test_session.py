"""A policy that is driven by hand."""

import os
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from standing_still import StandingStill

from iowbc.evaluation.play import Source
from iowbc.evaluation.play_request import PlayRequest
from iowbc.live import session as driven
from iowbc.live.session import PUSH_DURATION, Session
from iowbc.task.vector.vector_env import VectorEnv


def run(session: Session, steps: int) -> None:
    for _ in range(steps):
        session.step()


def drawn(session: Session, name: str) -> float:
    return float(session.environment.drawn()[name][0])


def test_what_is_wanted_is_approached_at_the_recipe_s_rate(session: Session) -> None:
    rate, period = session.source.world.recipe.task.commands.rates.velocity, session.environment.period
    session.wanted[0] = 0.2
    run(session, 5)
    assert session.track.moments[-1].command[0] == pytest.approx(5 * rate * period)
    run(session, 10)
    assert session.track.moments[-1].command[0] == pytest.approx(0.2)


def test_an_episode_begins_standing_in_the_wanted_posture(session: Session) -> None:
    session.wanted[[0, 3]] = (0.4, 0.65)
    session.reset()
    assert session.track.moments[0].command[[0, 3]] == pytest.approx([0.0, 0.65])


def test_a_command_beyond_what_is_feasible_is_clamped(session: Session) -> None:
    session.wanted[3] = 0.2
    session.reset()
    assert session.track.moments[0].command[3] > 0.4


@pytest.mark.parametrize("what", ["robot", "object"])
def test_a_push_has_the_size_and_the_direction_that_were_asked_for(session: Session, what: driven.Pushed) -> None:
    simulation, period = session.environment.batch.simulation, session.environment.period
    heading = session.environment.batch.memory.heading_reference[0]
    given = []
    session.push(what, "left", 12.0)
    for _ in range(round(PUSH_DURATION / period) + 3):
        session.step()
        force = simulation.state.push_force[0] if what == "robot" else simulation.impulse_force(0)
        given.append(force.copy())
    assert np.sum(given, axis=0) * period == pytest.approx([-12.0 * np.sin(heading), 12.0 * np.cos(heading), 0.0])
    assert not np.any(given[round(PUSH_DURATION / period) :])


def test_a_push_moves_who_is_pushed(session: Session) -> None:
    speeds = []
    for impulse in (0.0, 12.0):
        session.reset()
        session.push("robot", "left", impulse)
        run(session, 6)
        heading = session.environment.batch.memory.heading_reference[0]
        left = np.array([-np.sin(heading), np.cos(heading), 0.0])
        speeds.append(float(session.environment.batch.simulation.state.base_linear_velocity[0] @ left))
    assert speeds[1] - speeds[0] > 0.15


def test_a_drag_lasts_until_it_is_let_go(session: Session) -> None:
    simulation = session.environment.batch.simulation
    session.pull["object"] = np.array([0.0, 8.0, 3.0])
    run(session, 3)
    assert simulation.impulse_force(0) == pytest.approx([0.0, 8.0, 3.0])
    assert [force.kind for force in session.track.moments[-1].forces].count("push") == 1
    session.drag(())
    session.step()
    assert not simulation.impulse_force(0).any()


def test_other_conditions_begin_a_new_episode_with_them_and_keep_the_command(session: Session) -> None:
    session.wanted[0] = 0.3
    run(session, 3)
    session.begin(PlayRequest(mass=9.0, partner_share=0.4))
    assert (drawn(session, "object_mass"), drawn(session, "partner_share")) == (9.0, 0.4)
    assert (len(session.track.moments), session.wanted[0]) == (1, 0.3)
    session.begin(PlayRequest(scene="push", mass=30.0))
    assert session.environment.batch.scenes[0] == "push"
    assert session.track.held_weight == 0.0


def test_without_a_mass_nothing_is_held_and_nothing_can_be_pushed_but_the_robot(session: Session) -> None:
    session.begin(PlayRequest(mass=0.0))
    session.push("object", "forward", 20.0)
    session.step()
    assert not session.environment.batch.simulation.state.has_object[0]
    assert np.isfinite(session.track.moments[-1].bodies).all()


def test_after_its_end_an_episode_rests_until_it_is_begun_again(session: Session) -> None:
    session.pull["robot"] = np.array([600.0, 0.0, -200.0])
    run(session, 150)
    assert session.track.ending in ("fallen", "dropped")
    count = len(session.track.moments)
    session.step()
    assert len(session.track.moments) == count
    session.drag(())
    session.reset()
    run(session, 2)
    assert (session.track.ending, len(session.track.moments)) == ("", 3)


def test_a_checkpoint_that_is_written_again_is_taken_while_the_episode_goes_on(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checkpoint, loaded = tmp_path / "training.checkpoint", []
    checkpoint.write_bytes(b"1")

    def opening(asked: Source, environment: VectorEnv) -> StandingStill:
        loaded.append(asked.policy.read_bytes())
        return StandingStill()

    monkeypatch.setattr(driven, "open_policy", opening)
    with closing(Session(replace(source, policy=checkpoint, key="k" * 64), PlayRequest())) as session:
        session.refresh()
        assert loaded == [b"1"]
        run(session, 2)
        checkpoint.write_bytes(b"2")
        os.utime(checkpoint, (session.written + 5, session.written + 5))
        session.refresh()
        assert loaded == [b"1", b"2"]
        run(session, 2)
        assert len(session.track.moments) == 5
        checkpoint.unlink()
        session.refresh()
        session.begin(PlayRequest(mass=5.0))
        assert (drawn(session, "object_mass"), loaded) == (5.0, [b"1", b"2"])
