"""A game of the skill layer whose human is a person: the mouse leads a spring and damper at the object's far handle."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import viser

from iowbc.arrays import Array
from iowbc.learning.networks import TeacherNetwork
from iowbc.live.drag import Drag
from iowbc.live.drawing import GameMarks
from iowbc.live.panel import LAST_SEED, Button, ControlPanel, table_row
from iowbc.live.session import Played
from iowbc.live.track import PAST, WINDOW, Moment, MomentRecorder, Track
from iowbc.robot import rotations
from iowbc.sim.rendering.forces import Force
from iowbc.skill.episodes import Plan, Rule
from iowbc.skill.game import NOMINAL
from iowbc.skill.lower_layer import Student
from iowbc.skill.single_game import SingleGame
from iowbc.task.specification import Specification

TIME_LIMIT = 600.0
"""Time limit of a game [s], long because a person first explores the controls."""
ROBOTS: dict[str, Rule | None] = {"skill": None, "admittance follower": "follow", "stands": "stand"}
"""Robots that a person can compare: the trained skill, and the rule of one without."""


class GameSession(Played):
    """One game after another, with a person as the human."""

    view = ((2.2, -1.7, 1.5), (0.4, 0.0, 0.6))

    def __init__(self, world: Specification, student: Student, skill: TeacherNetwork, request: Plan) -> None:
        """`skill`: the robot's policy in games without a rule of `ROBOTS`. Raises UsageError for an unknown task."""
        recipe = world.recipe
        tasks = recipe.skill.tasks
        slow = {name: getattr(tasks, name).model_copy(update={"duration": TIME_LIMIT}) for name in tasks.names}
        section = recipe.skill.model_copy(update={"tasks": tasks.model_copy(update=slow)})
        self.world, self._student = replace(world, recipe=recipe.model_copy(update={"skill": section})), student
        self._skill = skill
        self._grip: tuple[Array, bool] | None = None
        self._open(request)

    def _open(self, request: Plan) -> None:
        networks = NOMINAL | {"robot": self._skill if request.rule is None else None}
        self.request, self._game = request, SingleGame(self.world, self._student, networks, request)
        self._lower = self._game.lower
        self.robot, self.period = self._lower.robot, self._lower.period
        self._recorder = MomentRecorder(self._lower, {})
        self.reset()

    def reset(self) -> None:
        self._game.reset()
        batch, state = self._game.batch, self._lower.simulation.state
        self._grip, batch.hand[:] = None, np.nan
        away = self._lower.simulation.partner.at - state.object_position
        handle = rotations.rotate_inverse(state.object_quaternion, away)[0]
        self.marks = GameMarks(self._game.lines(), handle)
        title = f"{self.request.task}, {self._game.mass:.0f} kg"
        self.track = Track(self._recorder, self.world, title, round(PAST / self.period))
        self.track.moments.append(self._look())

    def step(self) -> None:
        if self.track.ending:
            return
        self._game.control()
        self.track.moments.append(self._look())
        self._game.judge()
        self.track.ending = self._game.ending

    def drag(self, drags: Sequence[Drag]) -> None:
        """Leads the hand at the handle to the pointer: on its level, and upward with the shift key. The newest drag
        counts; without any the hand lets go."""
        simulation, hand = self._lower.simulation, self._game.batch.hand[0]
        drag = next((drag for drag in reversed(drags) if drag.body == "object"), None)
        if drag is None:
            self._grip, hand[:] = None, np.nan
            return
        if self._grip is None or self._grip[1] != drag.shift:
            self._grip = drag.start - simulation.partner.at[0], drag.shift
            hand[:] = *simulation.partner.at[0, :2], simulation.partner.aim[0, 2]
        beside = self._grip[0]
        if drag.shift:
            hand[2] = drag.end[2] - beside[2]
        elif (point := drag.on_plane(drag.start[2])) is not None:
            hand[:2] = (point - beside)[:2]

    def close(self) -> None:
        self._game.close()

    def _look(self) -> Moment:
        """The present moment; of the partner's force the arrow shows the horizontal part, which the mouse makes."""
        now, simulation, moment = self._game.batch.now, self._lower.simulation, self._recorder.look(self._game.seconds)
        force = simulation.state.partner_force[0]
        way = {"covered": now.covered.copy(), "length": now.covered + now.left, "lateral": now.lateral.copy()}
        pull = Force("partner", simulation.partner.at[0], force * [1.0, 1.0, 0.0])
        others = tuple(force for force in moment.forces if force.kind != "partner")
        return replace(moment, forces=(pull, *others), signals=way | {"share": force[2:].copy()})


class GamePanel(ControlPanel):
    """Choice of the game; the mouse does the rest."""

    _session: GameSession

    def _add_tabs(self, tabs: viser.GuiTabGroupHandle) -> None:
        request, gui = self._session.request, self._gui
        robot = next(name for name, rule in ROBOTS.items() if rule == request.rule)
        self._names = self._session.world.recipe.skill.tasks.names
        with tabs.add_tab("Game"):
            gui.add_markdown(
                "Drag the green handle: a spring pulls it to the mouse, along the ground, and with Shift up and down. "
                "Let go, and you only bear your share of the weight. The robot does not know the path."
            )
            self.task = gui.add_dropdown("Task", self._names, initial_value=request.task)
            self._button(gui.add_button("Next task"), "next task")
            self.rival = gui.add_dropdown("Robot", tuple(ROBOTS), initial_value=robot)
            self.seed = gui.add_number("Seed", request.seed, min=0, max=LAST_SEED, step=1, hint="Of load and spring")

    @property
    def conditions(self) -> Plan:
        rule = ROBOTS[self.rival.value]
        return replace(self._session.request, task=self.task.value, seed=int(self.seed.value), rule=rule)

    def press(self, button: Button) -> None:
        if button == "next task":
            self.task.value = self._names[(self._names.index(self.task.value) + 1) % len(self._names)]

    def figures_at(self, track: Track, place: int) -> str:
        latest = track.latest(place)
        moment, pulls = latest[-1], [np.linalg.norm(one.forces[0].force) for one in latest]
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
