"""Controls and figures of a game that a person plays."""

from collections.abc import Sequence

import numpy as np
import viser

from iowbc.live.game import ROBOTS, GameRequest, GameSession
from iowbc.live.panel import LAST_SEED, Button, ControlPanel, table_row
from iowbc.live.track import WINDOW, Track


class GamePanel(ControlPanel):
    """Choice of the game; the mouse does the rest."""

    def __init__(self, gui: viser.GuiApi, session: GameSession, trials: Sequence[str]) -> None:
        self._session = session
        super().__init__(gui, session, trials)

    def _add_tabs(self, tabs: viser.GuiTabGroupHandle) -> None:
        request, gui = self._session.request, self._gui
        self._names = self._session.world.recipe.skill.tasks.names
        with tabs.add_tab("Game"):
            gui.add_markdown(
                "Drag the green handle: a spring pulls it to the mouse, along the ground, and with Shift up and down. "
                "Let go, and you only bear your share of the weight. The robot does not know the path."
            )
            self.task = gui.add_dropdown("Task", self._names, initial_value=request.task)
            self._button(gui.add_button("Next task"), "next task")
            self.rival = gui.add_dropdown("Robot", tuple(ROBOTS), initial_value=request.robot)
            self.seed = gui.add_number("Seed", request.seed, min=0, max=LAST_SEED, step=1, hint="Of load and spring")

    @property
    def conditions(self) -> GameRequest:
        return GameRequest(self.task.value, int(self.seed.value), self.rival.value)

    def steer(self) -> None:
        """The mouse steers."""

    def press(self, button: Button) -> None:
        if button == "next task":
            self.task.value = self._names[(self._names.index(self.task.value) + 1) % len(self._names)]

    def figures_at(self, track: Track, place: int) -> str:
        moment = track.moments[place]
        first = max(0, place + 1 - round(WINDOW / track.period))
        pulls = [np.linalg.norm(track.moments[index].forces[0].force) for index in range(first, place + 1)]
        signals = {name: float(values[0]) for name, values in moment.signals.items()}
        rows = [
            ("your pull", f"{pulls[-1]:.0f} N"),
            (f"mean of the last {WINDOW:g} s", f"{np.mean(pulls):.0f} N"),
            ("weight that you bear", f"{signals['share']:.0f} N"),
            ("way along the path", f"{signals['covered']:.1f} of {signals['length']:.1f} m"),
            ("left of the path", f"{signals['lateral']:+.2f} m"),
            ("robot's command forward", f"{moment.command[0]:+.2f} m/s"),
            ("to the left", f"{moment.command[1]:+.2f} m/s"),
            ("turning left", f"{moment.command[2]:+.2f} rad/s"),
        ]
        body = "".join(table_row(*row) for row in rows)
        return f"<div style='padding:0 1em;font-size:0.8em'><table>{body}</table></div>"
