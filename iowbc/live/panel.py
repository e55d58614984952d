"""Controls and metrics beside the scene; the page polls the controls once per turn."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from math import isnan
from queue import SimpleQueue
from typing import Any, Literal

import numpy as np
import viser

from iowbc.control.command import COMMAND, VELOCITY, nominal_command
from iowbc.evaluation.play_request import PlayRequest
from iowbc.evaluation.trials.plan import DIRECTIONS
from iowbc.live.drag import Pushed
from iowbc.live.drawing import ShownParts
from iowbc.live.session import Played, Session
from iowbc.live.track import PAST, WINDOW, Track
from iowbc.recipe.task.commands import Commands

Button = Literal["pause", "reset", "push robot", "push object", "next task"]

LIVE = "live"
HEAVIEST = 2.0
"""Largest mass on the slider, in nominal masses of the scene's object."""
LIGHTEST = 1.0
"""The same in the scene without an object, where it says nothing [kg]."""
STRONGEST_PUSH = 60.0
"""Largest push on the slider [N·s]: what speeds a robot of 35 kg up by 1.7 m/s."""
LAST_SEED = 2**32 - 1
LABELS = ("forward [m/s]", "left [m/s]", "turn left [rad/s]", "height [m]", "lean [rad]")
"""Sliders of the command's first entries, in its order."""
ERRORS = {"E_v": ("v", "m/s"), "E_psi": ("ψ", "rad"), "E_alpha": ("α", "rad"), "E_h": ("h", "m")}
"""Index of an error's symbol, and its unit."""
CELL = "padding:0 0.6em 0 0;text-align:right"
NAME = "padding:0 0.6em 0 0;text-align:left"


class ControlPanel(ABC):
    """Controls of every page; all tabs of the browser share them."""

    def __init__(self, gui: viser.GuiApi, session: Played, trials: Sequence[str]) -> None:
        """`trials`: titles of recorded trials to choose from; none are offered where there are none."""
        self._gui, self._session = gui, session
        self._pressed: SimpleQueue[Button] = SimpleQueue()
        gui.main_panel.dock_right()
        self.status = gui.add_markdown("")
        self.showing = gui.add_dropdown("Show", (LIVE, *trials), initial_value=LIVE, visible=bool(trials))
        self._pause = self._button(gui.add_button("Pause"), "pause")
        self._button(gui.add_button("Reset", hint="Begin the episode, or the trial, from its start"), "reset")
        self.time = gui.add_slider("Time [s]", -PAST, 0.0, 0.02, 0.0, hint="Drag to look at what has been")
        self.speed = gui.add_slider("Speed", 0.1, 1.0, 0.1, 1.0, hint="1 is real time")
        tabs = gui.add_tab_group()
        self._add_tabs(tabs)
        with tabs.add_tab("View"):
            usual = ShownParts()
            self._shown = {
                "forces": gui.add_checkbox("Forces", usual.forces),
                "support": gui.add_checkbox("Support polygon, centre of mass", usual.support),
                "reference": gui.add_checkbox("Reference posture", usual.reference),
                "collision": gui.add_checkbox("Shapes that touch", usual.collision),
                "follow": gui.add_checkbox("Follow the robot", usual.follow),
            }
        self.figures = gui.add_html("")

    @abstractmethod
    def _add_tabs(self, tabs: viser.GuiTabGroupHandle) -> None:
        """Adds the session's own tabs."""

    @property
    @abstractmethod
    def conditions(self) -> Any:
        """The requested episode, as an argument of `Played.begin`."""

    def steer(self) -> None:  # noqa: B027 (in a game the mouse steers)
        """Hands the controls over to the session before a step."""

    @abstractmethod
    def press(self, button: Button) -> None:
        """Carry out the action of a button in the session's own tabs."""

    @abstractmethod
    def figures_at(self, track: Track, place: int) -> str:
        """Figures of the moment at an index of a track, as HTML."""

    def _button(self, handle: viser.GuiButtonHandle, name: Button) -> viser.GuiButtonHandle:
        handle.on_click(lambda _: self._pressed.put(name))
        return handle

    @property
    def shown(self) -> ShownParts:
        return ShownParts(**{name: box.value for name, box in self._shown.items()})

    def pressed(self) -> list[Button]:
        """Buttons pressed since the last call."""
        return [self._pressed.get() for _ in range(self._pressed.qsize())]

    def label_pause(self, paused: bool) -> None:
        """Label the pause button with its next action."""
        self._pause.label = "Go on" if paused else "Pause"


class DrivingPanel(ControlPanel):
    """Controls of a policy that is driven by hand: command, pushes, conditions of the episode."""

    _session: Session

    def _add_tabs(self, tabs: viser.GuiTabGroupHandle) -> None:
        gui, self._recipe = self._gui, self._session.source.world.recipe
        request = self._session.request
        with tabs.add_tab("Command"):
            self._command = self._commands(self._recipe.task.commands)
            gui.add_button("Stand still").on_click(lambda _: self._stand())
        with tabs.add_tab("Push"):
            gui.add_markdown("Drag the robot or the object with the mouse, or:")
            self.impulse = gui.add_slider("Size [N·s]", 1.0, STRONGEST_PUSH, 1.0, 15.0)
            self.direction = gui.add_dropdown("Direction", tuple(DIRECTIONS), initial_value="forward")
            self._button(gui.add_button("Push the robot"), "push robot")
            self._button(gui.add_button("Push the object"), "push object")
        with tabs.add_tab("Episode"):
            gui.add_markdown("Every change begins a new episode.")
            self.scene = gui.add_dropdown("Scene", self._recipe.simulation.scenes.names, initial_value=request.scene)
            most = max(request.mass, self._heaviest(request.scene))
            self.mass = gui.add_slider("Mass [kg]", 0.0, most, 0.5, request.mass, hint="0 is without an object")
            share = request.partner_share
            self.partner_share = gui.add_slider("Partner's share", 0.0, 1.0, 0.05, share, hint="Of the weight")
            self.seed = gui.add_number("Seed", request.seed, min=0, max=LAST_SEED, step=1)
            self.disturbances = gui.add_checkbox("Impulses, pushes", request.disturbances, hint="At random times")
            self.scene.on_update(lambda _: self._suit_mass())

    def steer(self) -> None:
        self._session.wanted[:] = [slider.value for slider in self._command]

    def press(self, button: Button) -> None:
        what: Pushed = "robot" if button == "push robot" else "object"
        self._session.push(what, self.direction.value, self.impulse.value)

    def figures_at(self, track: Track, place: int) -> str:
        """The command and the state at a moment, and the errors of the seconds before."""
        signals, (means, saturated) = track.moments[place].signals, track.readings(place)
        going, wanted = signals["system_velocity"], signals["commanded_velocity"]
        rows = [
            ("forward", wanted[0], going[0], "m/s"),
            ("left", wanted[1], going[1], "m/s"),
            ("height", signals["height_command"][0], signals["pelvis_height"][0], "m"),
            ("lean", signals["torso_pitch_command"][0], signals["torso_pitch"][0], "rad"),
        ]
        asked = [table_row(name, f"{first:+.2f}", f"{second:+.2f} {unit}") for name, first, second, unit in rows]
        errors = [table_row(f"E<sub>{i}</sub>", f"{means[name]:.3f} {unit}") for name, (i, unit) in ERRORS.items()]
        hands = "–" if isnan(means["weight_in_hands"]) else f"{100 * means['weight_in_hands']:.0f} %"
        worst = sorted(saturated.items(), key=lambda pair: -pair[1])
        limits = ", ".join(f"{escape(name.removesuffix('_joint'))} {100 * share:.0f} %" for name, share in worst)
        head = table_row("", "command", "is")
        return (
            f"<div style='padding:0 1em;font-size:0.8em'><table>{head}{''.join(asked)}</table>"
            f"<p style='margin:0.4em 0'>Means of the last {WINDOW:g} s:</p><table>{''.join(errors)}"
            f"{table_row('weight in the hands', hands)}</table>"
            f"<p style='margin:0.4em 0'>Joints at their torque limit: {limits or 'none'}</p></div>"
        )

    def _commands(self, commands: Commands) -> list[viser.GuiSliderHandle]:
        """A slider for each entry of the command, over what training commands."""
        wrist = np.add(commands.common_offset, commands.single_offset)
        pitch = min(commands.pitch[0], commands.deep_pitch[0]), max(commands.pitch[1], commands.deep_pitch[1])
        ranges = [commands.velocity_x, commands.velocity_y, commands.yaw_rate, commands.height, pitch]
        rows: list[viser.GuiSliderHandle] = []
        for label, (low, high), start in zip(LABELS, ranges, nominal_command(commands)[:5], strict=True):
            rows.append(self._gui.add_slider(label, low, high, 0.01, float(np.clip(start, low, high))))
        with self._gui.add_folder("Wrists", expand_by_default=False):
            for name, reach in zip(COMMAND[5:], np.tile(wrist, 2).tolist(), strict=True):
                rows.append(self._gui.add_slider(f"{name.replace('_', ' ')} [m]", -reach, reach, 0.005, 0.0))
        return rows

    def _suit_mass(self) -> None:
        """Adapt the range of the mass to the scene's object."""
        most = self._heaviest(self.scene.value)
        self.mass.value = min(self.mass.value, most)
        self.mass.max = most

    def _heaviest(self, scene: str) -> float:
        thing = getattr(self._recipe.simulation.scenes, scene).object
        return HEAVIEST * thing.mass if thing else LIGHTEST

    def _stand(self) -> None:
        for slider in self._command[VELOCITY]:
            slider.value = 0.0

    @property
    def conditions(self) -> PlayRequest:
        return replace(
            self._session.request,
            scene=self.scene.value,
            mass=self.mass.value,
            partner_share=self.partner_share.value,
            seed=int(self.seed.value),
            disturbances=self.disturbances.value,
        )


def table_row(name: str, *values: str) -> str:
    return f"<tr><td style='{NAME}'>{name}</td>" + "".join(f"<td style='{CELL}'>{v}</td>" for v in values) + "</tr>"
