"""Browser view of a simulation, drawn in a separate process that the simulation never waits for."""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import viser

from iowbc.arrays import Array
from iowbc.live.drag import Pushed, spring_pulls
from iowbc.live.drawing import Drawing, ShownParts
from iowbc.live.page import PICTURES
from iowbc.live.server import serving
from iowbc.live.track import SimulationRecorder
from iowbc.robot.description import Robot
from iowbc.sim.rendering.forces import Force
from iowbc.sim.simulation import Simulation

NICENESS = 10
"""Niceness added to the page's process, so that the simulation has priority."""
STARTING = 120.0
"""Time that the page is given to begin before the simulation does [s]."""


Asked = tuple[bool, dict[Pushed, Array]]
"""A page's request for a picture: whether the button to release the robot was pressed since the last one, and the
forces of the mouse, world frame, (3,) each [N]."""


class RemoteView:
    """The page of a simulation. It requests each picture, so that no unused ones are made."""

    def __init__(self, simulation: Simulation, port: int) -> None:
        """Start to serve on a port of this machine, which must be free."""
        self._recorder = SimulationRecorder(simulation)
        self._requests, theirs = multiprocessing.Pipe()
        given = theirs, port, simulation.robot, self._recorder.model
        process = multiprocessing.get_context("spawn").Process(target=_serve, args=given, daemon=True)
        process.start()
        theirs.close()
        self._requests.poll(STARTING)

    def asked(self) -> Asked | None:
        """The page's request, if there is one. Raises EOFError once the page has ended."""
        try:
            return self._requests.recv() if self._requests.poll() else None
        except ConnectionResetError as error:  # the page ended with an answer unread
            raise EOFError from error

    def answer(self, seconds: float, beside: Sequence[Force], status: str, supported: bool) -> None:
        """Send the simulation's current state, `seconds` after its start, with additional forces `beside`; `supported`:
        there is a support to release."""
        moment = self._recorder.look(seconds)
        shown = replace(moment, forces=(*moment.forces, *beside))
        with contextlib.suppress(BrokenPipeError):  # the page has ended; `asked` will raise
            self._requests.send((shown, status, supported))

    def close(self) -> None:
        self._requests.close()


def _serve(requests: Connection, port: int, robot: Robot, model: Any) -> None:
    """The process of the page, until the simulation's end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C reaches both processes; the simulation ends this one
    os.nice(NICENESS)
    with serving(port) as server, contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        draw(server, requests, robot, model)


def draw(server: viser.ViserServer, requests: Connection, robot: Robot, model: Any) -> None:
    """Draws one picture after the other. Raises EOFError or OSError once the simulation has ended."""
    pressed = threading.Event()
    drawing = Drawing(server, robot)
    status = server.gui.add_markdown("")
    button = server.gui.add_button("Release the robot", hint="From its band or fixture")
    button.on_click(lambda _: pressed.set())
    while True:
        begin = time.monotonic()
        if release := pressed.is_set():
            pressed.clear()
        requests.send((release, spring_pulls(drawing.drags.now(drawing.away))))
        moment, text, supported = requests.recv()
        with server.atomic():
            drawing.show(model, moment, ShownParts())
            status.content, button.visible = text, supported
        time.sleep(max(0.0, begin + PICTURES - time.monotonic()))
