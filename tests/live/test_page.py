"""The page: what the controls do, without a browser and with one."""

import json
import socket
from dataclasses import replace

import numpy as np
import pandas as pd
import psutil
import pytest
from standing_still import StandingStill

from iowbc.commands.options import HOST
from iowbc.errors import UsageError
from iowbc.evaluation.films import Actor
from iowbc.evaluation.play import requested_episode
from iowbc.evaluation.play_request import PlayRequest
from iowbc.evaluation.trials.rollout import play_in
from iowbc.live.drawing import ShownParts
from iowbc.live.page import SETTLED, Page
from iowbc.live.panel import LIVE
from iowbc.live.server import serving
from iowbc.live.session import Session
from iowbc.live.track import trial_title
from iowbc.recipe.evaluation.sequences import Segment

STANDING = (Segment(duration=0.2, ramp=0.0),)


@pytest.fixture
def actor(session: Session) -> Actor:
    """An evaluation of one trial of 0.2 s."""
    source = session.source
    episode = requested_episode(source.world.recipe, PlayRequest(mass=6.0, sequence=STANDING))
    row = {"suite": "lifting", "case": "lifting", "mass": 6.0, "impulse": 0.0, "trial": 0, "end": "finished"}
    row |= {"seconds": 0.2, "episode": json.dumps(episode.as_json()), "batch_size": 1, "batch_row": 0}
    return Actor(source.world, StandingStill(), pd.DataFrame([row]))


class Clock:
    """Turns a page at the pace of the simulation."""

    def __init__(self, page: Page) -> None:
        self.page, self.now = page, 100.0

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.page.session.environment.period)):
            self.now += self.page.session.environment.period
            self.page.turn(self.now)


def test_the_server_listens_to_this_machine_alone() -> None:
    with serving(0) as server:
        port = server.get_port()
        listening = [one for one in psutil.Process().net_connections() if one.status == psutil.CONN_LISTEN]
        assert {one.laddr.ip for one in listening if one.laddr.port == port} == {HOST}
        assert server.request_share_url() is None
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((HOST, port), timeout=2.0)


def test_a_taken_port_is_refused() -> None:
    with socket.socket() as other:
        other.bind((HOST, 0))
        other.listen()
        with pytest.raises(UsageError, match="is taken; try another --port"), serving(other.getsockname()[1]):
            pass


def test_a_slider_changes_the_command_in_force(page: Page) -> None:
    clock = Clock(page)
    clock.run(0.1)
    assert page.track.moments[-1].command[0] == 0.0
    page.panel._command[0].value = 0.2
    clock.run(0.4)
    assert page.track.moments[-1].command[0] == pytest.approx(0.2)


def test_the_pace_is_that_of_the_slider(page: Page) -> None:
    clock = Clock(page)
    clock.run(0.02)
    begun = page.track.end
    page.panel.speed.value = 0.5
    clock.run(0.4)
    assert page.track.end - begun == pytest.approx(0.2, abs=0.03)


def test_buttons_push_pause_and_begin_again(page: Page) -> None:
    clock, simulation = Clock(page), page.session.environment.batch.simulation
    page.panel._pressed.put("push robot")
    clock.run(0.04)
    assert np.linalg.norm(simulation.planned_push[0]) == pytest.approx(page.panel.impulse.value / 0.1)
    page.panel._pressed.put("pause")
    clock.run(0.02)
    stopped = page.track.end
    clock.run(0.1)
    assert page.track.end == stopped
    page.panel._pressed.put("reset")
    clock.run(0.02)
    assert (page.track.end, page.paused) == (0.0, True)


def test_the_past_of_a_live_episode_can_be_looked_at(page: Page) -> None:
    clock = Clock(page)
    clock.run(0.4)
    page.panel.time.value = -0.2
    clock.run(0.1)
    assert page.paused
    moment = page.track.moments[page.place]
    assert moment.seconds == pytest.approx(page.track.end - 0.2)
    pelvis = page.track.model.body("pelvis").id
    assert page.drawing._bodies[pelvis].position == pytest.approx(moment.bodies[pelvis, :3], abs=1e-6)
    page.panel._pressed.put("pause")
    clock.run(0.1)
    assert (page.paused, page.panel.time.value) == (False, 0.0)


def test_another_mass_begins_a_new_episode_once_the_slider_rests(page: Page) -> None:
    clock = Clock(page)
    clock.run(0.1)
    page.panel.mass.value = 8.0
    clock.run(0.5 * SETTLED)
    assert page.session.request.mass == 4.0
    page.panel.mass.value = 9.0
    clock.run(0.5 * SETTLED)
    assert page.session.request.mass == 4.0
    clock.run(SETTLED)
    assert page.session.environment.drawn()["object_mass"][0] == 9.0
    assert page.track is page.session.track


def test_the_mass_suits_the_scene(page: Page) -> None:
    page.panel.scene.value = "push"
    page.panel.mass.value = 100.0
    page.panel.scene.value = "lift"
    assert page.panel.mass.value == page.panel.mass.max == 14.0


def test_what_is_drawn_follows_the_boxes(page: Page) -> None:
    clock = Clock(page)
    clock.run(0.1)
    assert page.drawing._forces.visible
    assert not any(ghost.visible for ghost in page.drawing._ghosts.values())
    page.panel._shown["forces"].value = False
    page.panel._shown["reference"].value = True
    page.panel._shown["collision"].value = True
    clock.run(0.1)
    assert not page.drawing._forces.visible
    assert all(ghost.visible for ghost in page.drawing._ghosts.values())
    assert not any(handle.visible for handle in page.drawing._looks)


def test_arrows_and_support_polygon_keep_their_shape_when_the_robot_has_moved(page: Page) -> None:
    Clock(page).run(0.4)
    drawing, moment, track = page.drawing, page.track.moments[page.place], page.track
    drawing.show(track.model, moment, ShownParts())
    arrows, polygon, under = drawing._forces.points, drawing._support.vertices, drawing._beneath.position.copy()
    assert arrows[0, 0] + under == pytest.approx(moment.forces[0].start, abs=1e-6)
    way = np.array([3.0, -2.0, 0.0])
    bodies = moment.bodies.copy()
    bodies[:, :3] += way
    forces = tuple(replace(force, start=force.start + way) for force in moment.forces)
    drawing.show(track.model, replace(moment, bodies=bodies, forces=forces, support=moment.support + way), ShownParts())
    np.testing.assert_allclose(drawing._forces.points, arrows, rtol=0, atol=1e-6)
    np.testing.assert_allclose(drawing._support.vertices, polygon, rtol=0, atol=1e-6)
    np.testing.assert_allclose(drawing._beneath.position - under, way, rtol=0, atol=1e-6)


def test_a_trial_is_looked_through_as_it_was_recorded(session: Session, actor: Actor) -> None:
    row = actor.trials.iloc[0]
    environment = session.source.environment(
        requested_episode(session.source.world.recipe, PlayRequest(mass=6.0, sequence=STANDING))
    )
    recorded = play_in(environment, StandingStill())[0].trace
    environment.close()
    title = trial_title(row)
    assert title == f"lifting, 6 kg, trial 0: finished after {row['seconds']} s"
    with serving(0) as server:
        page = Page(server, session, actor)
        clock = Clock(page)
        clock.run(0.04)
        page.panel.showing.value = title
        clock.run(0.02)
        page.panel._pressed.put("pause")
        pelvis = page.track.model.body("pelvis").id
        for seconds, step in ((0.14, 7), (0.04, 2)):
            page.panel.time.value = seconds
            clock.run(0.06)
            shown = page.drawing._bodies[pelvis].position
            assert shown == pytest.approx(recorded.base_position[step - 1], abs=1e-6)
        page.panel.showing.value = LIVE
        clock.run(0.06)
        assert page.track is session.track
