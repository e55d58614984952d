"""The page of a simulation in another process."""

import multiprocessing
import threading
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection

import numpy as np
import psutil
import pytest
import viser

from iowbc.live.remote_view import RemoteView, draw
from iowbc.live.server import LocalServer, serving
from iowbc.live.session import Session
from iowbc.live.track import SimulationRecorder
from iowbc.sim.rendering.forces import Force


@pytest.fixture
def page(session: Session) -> Iterator[tuple[LocalServer, Connection, SimulationRecorder]]:
    """A page that is drawn in a thread, the pipe on which it asks, and what it is shown."""
    recorder = SimulationRecorder(session.environment.batch.simulation)
    ours, theirs = multiprocessing.Pipe()

    def drawing() -> None:
        with pytest.raises((EOFError, OSError)):
            draw(server, theirs, session.environment.batch.robot, recorder.model)

    with serving(0) as server:
        thread = threading.Thread(target=drawing)
        thread.start()
        yield server, ours, recorder
        ours.close()
        thread.join()


def test_a_page_draws_what_it_is_sent_and_asks_for_more(
    page: tuple[LocalServer, Connection, SimulationRecorder],
) -> None:
    server, requests, recorder = page
    released, _ = requests.recv()
    assert not released
    moment = recorder.look(1.0)
    requests.send((moment, "held by band", True))
    requests.recv()
    frame = server.scene._handle_from_node_name["/world/bodies/pelvis"]
    assert frame.position == pytest.approx(moment.bodies[recorder.model.body("pelvis").id, :3], abs=1e-6)
    (button,) = (
        each for each in server.gui._gui_input_handle_from_uuid.values() if isinstance(each, viser.GuiButtonHandle)
    )
    for call in button._impl.update_cb:
        call(None)
    requests.send((moment, "held by band", False))
    assert requests.recv()[0]
    assert not button.visible
    requests.send((moment, "", False))
    assert not requests.recv()[0]


@pytest.mark.integration
def test_the_process_of_a_page_asks_for_pictures_and_ends_with_the_simulation(session: Session) -> None:
    with serving(0) as other:
        port = other.get_port()
    view = RemoteView(session.environment.batch.simulation, port)
    (child,) = (each for each in psutil.Process().children() if "spawn_main" in " ".join(each.cmdline()))
    for _ in range(3):
        while (asked := view.asked()) is None:
            time.sleep(0.002)
        assert asked[1]["robot"] == pytest.approx(np.zeros(3))
        view.answer(1.0, (Force("band", np.ones(3), np.full(3, 100.0)),), "", True)
    view.close()
    child.wait(60)


@pytest.mark.integration
def test_a_simulation_is_told_that_its_page_has_ended(session: Session) -> None:
    with serving(0) as other:
        port = other.get_port()
    view = RemoteView(session.environment.batch.simulation, port)
    (child,) = (each for each in psutil.Process().children() if "spawn_main" in " ".join(each.cmdline()))
    child.kill()
    child.wait(60)
    view.answer(1.0, (), "", True)
    first_request = view.asked()
    assert first_request is not None
    with pytest.raises(EOFError):
        view.asked()
