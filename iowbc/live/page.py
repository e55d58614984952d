"""The page: runs the session at the pace that the controls ask for, and shows it, or a trial, in the browser."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import viser

from iowbc.errors import Interrupted
from iowbc.evaluation.side_by_side import Actor
from iowbc.live.drawing import Drawing
from iowbc.live.panel import LIVE, PAST, ControlPanel, figures
from iowbc.live.session import Pushed, Session
from iowbc.live.track import Track, played_again, trial_titles

PICTURES = 1.0 / 25.0
"""Time between two pictures [s]."""
READING = 0.25
"""Time between two sets of figures [s]."""
SETTLED = 0.4
"""A new episode begins when the controls have stood still for so long [s]."""
LYING = 2.0
"""An episode that has ended stays to be seen for so long [s]."""
CHECKPOINTS = 2.0
"""Time between two looks for a newer checkpoint [s]."""
BEHIND = 0.2
"""A simulation that is further behind its pace lets the time go [s]."""
VIEW = (1.7, -1.4, 1.2)
"""First position of a camera [m]."""
AIM = (0.1, 0.0, 0.6)
"""At what it looks [m]."""


class Page:
    """The page of a session, and of the trials of an evaluation where there is one."""

    def __init__(self, server: viser.ViserServer, session: Session, evaluated: Actor | None = None) -> None:
        self.server, self.session, self._evaluated = server, session, evaluated
        recipe, robot = session.source.world.recipe, session.environment.batch.robot
        self.panel = ControlPanel(server.gui, recipe, session.request, self._trials)
        self.drawing = Drawing(server.scene, robot, session.pull)
        server.initial_camera.position, server.initial_camera.look_at = VIEW, AIM
        self.paused = False
        self.track: Track = session.track
        """The track that is shown: the session's own, or a trial."""
        self.place = 0
        """Index of its moment that is shown."""
        self._showing = LIVE
        self._cursor = self._slid = 0.0
        self._wish, self._wished = session.request, 0.0
        self._due = self._drawn = self._read = self._looked = self._now = 0.0
        self._ended: float | None = None
        self._pace = (0.0, 0.0)

    @cached_property
    def _trials(self) -> list[str]:
        return [] if self._evaluated is None else trial_titles(self._evaluated.trials)

    def run(self) -> None:
        """Runs until interrupted."""
        while True:
            self.turn(time.monotonic())
            time.sleep(max(0.0, min(self._due, self._drawn + PICTURES) - time.monotonic()))

    def turn(self, now: float) -> None:
        """Heeds the controls, moves on, and draws what is due at a time [s], no earlier than the last."""
        if not self._now:
            self._now = self._due = now
        elapsed, self._now = now - self._now, now
        self._heed_buttons()
        if self.panel.showing.value != self._showing:
            self._change_to(self.panel.showing.value)
        if self._showing == LIVE:
            self._live(now)
        else:
            self._again(elapsed)
        if now >= self._drawn + PICTURES:
            self._drawn = now
            self._draw(now)

    def _heed_buttons(self) -> None:
        for button in self.panel.pressed():
            if button == "pause":
                self._pause(not self.paused)
            elif button == "reset":
                self._reset()
            elif self._showing == LIVE:
                what: Pushed = "robot" if button == "push robot" else "object"
                self.session.push(what, self.panel.direction.value, self.panel.impulse.value)

    def _pause(self, paused: bool) -> None:
        self.paused = paused
        self.panel.label_pause(paused)
        if self._showing == LIVE:
            self._slide(0.0)
        elif not paused and self._cursor >= self.track.end:
            self._cursor = 0.0

    def _reset(self) -> None:
        self._cursor = 0.0
        if self._showing == LIVE:
            self.session.reset()
        self._slide(0.0)

    def _slide(self, seconds: float) -> None:
        """Sets the slider of the time, which is then told from one that somebody drags."""
        self.panel.time.value = seconds
        self._slid = self.panel.time.value

    def _change_to(self, title: str) -> None:
        """Shows another track, from its start: the session's own, or a trial that is first played again."""
        time_slider = self.panel.time
        if title == LIVE or self._evaluated is None:
            time_slider.min, time_slider.max = -PAST, 0.0
        else:
            row = self._evaluated.trials.iloc[self._trials.index(title)]
            try:
                self.track = played_again(
                    self._evaluated, row, lambda: bool(self.panel.showing.value != title), self._tell
                )
            except Interrupted:
                return
            time_slider.min, time_slider.max = 0.0, max(self.track.end, self.track.period)
        self._showing, self._cursor = title, 0.0
        self._slide(0.0)
        self._pause(False)

    def _tell(self, seconds: float) -> None:
        self.panel.status.content = f"Plays the trial again: {seconds:.0f} s"

    def _live(self, now: float) -> None:
        """Drives the session by hand."""
        session, panel = self.session, self.panel
        self._begin_anew(now)
        if now >= self._looked + CHECKPOINTS:
            self._looked = now
            session.refresh()
        if panel.time.value != self._slid:
            self._slid = panel.time.value
            if not self.paused:
                self.paused = True
                panel.label_pause(True)
        if not self.paused and now >= self._due:
            session.wanted[:] = panel.command
            session.step()
            self._due = max(self._due + session.environment.period / panel.speed.value, now - BEHIND)
        elif self.paused:
            self._due = now + PICTURES
        self._get_up(now)
        self.track = session.track
        self.place = self.track.place(self.track.end + (panel.time.value if self.paused else 0.0))

    def _begin_anew(self, now: float) -> None:
        """A new episode where other conditions are asked for, and no longer being changed."""
        wish = replace(self.panel.conditions, sequence=self.session.request.sequence)
        if wish != self._wish:
            self._wish, self._wished = wish, now
        elif wish != self.session.request and now >= self._wished + SETTLED:
            self.session.begin(wish)

    def _get_up(self, now: float) -> None:
        """Begins again some time after an episode's end."""
        if not self.session.track.ending:
            self._ended = None
        elif self._ended is None:
            self._ended = now
        elif now >= self._ended + LYING and not self.paused:
            self.session.reset()

    def _again(self, elapsed: float) -> None:
        """Moves on in a recorded trial."""
        if self.panel.time.value != self._slid:
            self._cursor = self._slid = self.panel.time.value
        elif not self.paused:
            self._cursor = min(self._cursor + elapsed * self.panel.speed.value, self.track.end)
            self._slide(self._cursor)
        self._due = self._now + PICTURES
        self.place = self.track.place(self._cursor)

    def _draw(self, now: float) -> None:
        moment = self.track.moments[self.place]
        with self.server.atomic():
            self.drawing.show(self.track.model, moment, self.panel.shown)
        if now >= self._read + READING:
            self.panel.status.content = self._status(now)
            self.panel.figures.content = figures(moment, self.track.readings(self.place))
            self._read = now

    def _status(self, now: float) -> str:
        track, moment = self.track, self.track.moments[self.place]
        words = [f"**{track.title}** · {moment.seconds:.1f} s"]
        if self.paused:
            words.append("paused")
        elif self._showing == LIVE:
            before, at = self._pace
            self._pace = (track.end, now)
            if track.end > before:
                words.append(f"{(track.end - before) / max(now - at, READING):.1f} × real time")
        if track.ending and self.place == len(track.moments) - 1:
            words.append(f"ended: {track.ending}")
        if self.session.source.key:
            words.append(time.strftime("checkpoint of %H:%M:%S", time.localtime(self.session.written)))
        return " · ".join(words)


def play_on_page(
    server: viser.ViserServer, session: Session, evaluated: Actor | None, ready: Callable[[], None]
) -> None:
    """Shows a session until interrupted; `ready` is called when the page is complete."""
    page = Page(server, session, evaluated)
    page.turn(time.monotonic())
    ready()
    page.run()
