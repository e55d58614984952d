"""The page: runs the session at the pace that the controls ask for, and shows it, or a trial, in the browser."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import viser

from iowbc.errors import Interrupted
from iowbc.evaluation.films import Actor
from iowbc.live.drawing import Drawing
from iowbc.live.panel import LIVE, ControlPanel, DrivingPanel
from iowbc.live.session import Played
from iowbc.live.track import PAST, Track, played_again, trial_title

PICTURES = 1.0 / 25.0
"""Time between two pictures [s]."""
READING = 0.25
"""Time between two sets of figures [s]."""
SETTLED = 0.4
"""Time without changes of the controls before a new episode starts [s]."""
RESTART_DELAY = 2.0
"""Time for which an ended episode stays visible [s]."""
CHECKPOINTS = 2.0
"""Time between two looks for a newer checkpoint [s]."""
BEHIND = 0.2
"""Maximum delay that a slow simulation tries to catch up [s]."""


class Page:
    """The page of a session, and of the trials of an evaluation where there is one."""

    def __init__(
        self,
        server: viser.ViserServer,
        session: Played,
        evaluated: Actor | None = None,
        panel: Callable[[viser.GuiApi, Any, Sequence[str]], ControlPanel] = DrivingPanel,
    ) -> None:
        """`panel`: makes the controls that fit the session, with the titles of the evaluated trials."""
        self.server, self.session, self._evaluated = server, session, evaluated
        self._trials = [] if evaluated is None else [trial_title(row) for _, row in evaluated.trials.iterrows()]
        self.panel = panel(server.gui, session, self._trials)
        self.drawing = Drawing(server, session.robot, session.view)
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

    def run(self, ready: Callable[[], None]) -> None:
        """Run until interrupted, paused while no browser is connected; `ready` is called once the page is complete."""
        self.turn(time.monotonic())
        ready()
        while True:
            if self.server.get_clients():
                self.turn(time.monotonic())
                time.sleep(max(0.0, min(self._due, self._drawn + PICTURES) - time.monotonic()))
            else:
                time.sleep(PICTURES)

    def turn(self, now: float) -> None:
        """Process the controls, advance, and draw if due; `now` [s] must not decrease."""
        if not self._now:
            self._now = self._due = now
        elapsed, self._now = min(now - self._now, BEHIND), now
        self._handle_buttons()
        if self.panel.showing.value != self._showing:
            self._change_to(self.panel.showing.value)
        if self._showing == LIVE:
            self._live(now)
        else:
            self._replay(elapsed)
        if now >= self._drawn + PICTURES:
            self._drawn = now
            self._draw(now)

    def _handle_buttons(self) -> None:
        for button in self.panel.pressed():
            if button == "pause":
                self._pause(not self.paused)
            elif button == "reset":
                self._cursor = 0.0
                if self._showing == LIVE:
                    self.session.reset()
                self._slide(0.0)
            elif self._showing == LIVE:
                self.panel.press(button)

    def _pause(self, paused: bool) -> None:
        self.paused = paused
        self.panel.label_pause(paused)
        if self._showing == LIVE:
            self._slide(0.0)
        elif not paused and self._cursor >= self.track.end:
            self._cursor = 0.0

    def _slide(self, seconds: float) -> None:
        """Set the time slider, and store its value to detect a drag by the user."""
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
                self.track = played_again(self._evaluated, row, lambda: self.panel.showing.value != title, self._tell)
            except Interrupted:
                return
            time_slider.min, time_slider.max = 0.0, max(self.track.end, self.track.period)
        self._showing, self._cursor = title, 0.0
        self._slide(0.0)
        self._pause(False)

    def _tell(self, seconds: float) -> None:
        self.panel.status.content = f"Plays the trial again: {seconds:.0f} s"

    def _live(self, now: float) -> None:
        session, panel = self.session, self.panel
        self._start_new_episode(now)
        if now >= self._looked + CHECKPOINTS:
            self._looked = now
            session.refresh()
        if panel.time.value != self._slid:
            self._slid, self.paused = panel.time.value, True
            panel.label_pause(True)
        if not self.paused and now >= self._due:
            panel.steer()
            session.drag(self.drawing.drags.now(self.drawing.away))
            session.step()
            self._due = max(self._due + session.period / panel.speed.value, now - BEHIND)
        elif self.paused:
            self._due = now + PICTURES
        self._restart_after_end(now)
        self.track = session.track
        self.place = self.track.place(self.track.end + (panel.time.value if self.paused else 0.0))

    def _start_new_episode(self, now: float) -> None:
        """Start a new episode once the controls request other conditions and are no longer being changed."""
        wish = self.panel.conditions
        if wish != self._wish:
            self._wish, self._wished = wish, now
        elif wish != self.session.request and now >= self._wished + SETTLED:
            self.session.begin(wish)

    def _restart_after_end(self, now: float) -> None:
        if not self.session.track.ending:
            self._ended = None
        elif self._ended is None:
            self._ended = now
        elif now >= self._ended + RESTART_DELAY and not self.paused:
            self.session.reset()

    def _replay(self, elapsed: float) -> None:
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
            marks = self.session.marks if self._showing == LIVE else None
            self.drawing.show(self.track.model, moment, self.panel.shown, marks)
        if now >= self._read + READING:
            self.panel.status.content = self._status(now)
            self.panel.figures.content = self.panel.figures_at(self.track, self.place)
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
        if self.session.checkpoint:
            words.append(self.session.checkpoint)
        return " · ".join(words)
