"""One game in this process, advanced by control steps: for a person who plays it, a window and a film."""

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import numpy as np

from iowbc.evaluation.films import Filming, velocity_text, written_film
from iowbc.evaluation.play import in_window, require_display
from iowbc.learning.networks import TeacherNetwork
from iowbc.robot.rotations import turned
from iowbc.sim.rendering.renderer import Line
from iowbc.skill.episodes import Plan
from iowbc.skill.game import COUNTED, TransportGame
from iowbc.skill.lower_layer import Student
from iowbc.skill.trained import mean_actions
from iowbc.task.specification import Specification

PATH, WALL = (0.1, 0.35, 0.8, 1.0), (0.55, 0.2, 0.15, 1.0)
HEIGHT = 0.01
"""Height of lines above the ground [m]."""
EVERY = 4
"""Every how many points of a path its line has a corner: 0.2 m."""


class SingleGame:
    """One game, at its beginning. Close it."""

    def __init__(
        self, world: Specification, student: Student, networks: Mapping[str, TeacherNetwork | None], plan: Plan
    ) -> None:
        """`networks`: policies of the agents, see `mean_actions`. Raises UsageError for an unknown task."""
        self._game, self._networks = TransportGame(world, student, n=1, plans=(plan,)), networks
        self.recipe = world.recipe
        self.duration = self._game.setup.tasks[plan.task].duration
        """Time limit [s]."""
        self.batch, self.lower = self._game.batch, self._game.batch.lower
        self.period = self.lower.period
        """Control period [s]."""
        self.steps: int
        """Control steps since the beginning."""
        self.ending: str
        """Reason of the game's end; empty before it."""
        self.reset()

    @property
    def seconds(self) -> float:
        """Time since the beginning [s]."""
        return self.steps * self.period

    @property
    def mass(self) -> float:
        """Mass of the object [kg]."""
        return float(self.lower.simulation.drawn["object_mass"][0])

    def reset(self) -> None:
        """Restart the game with the same random draws."""
        self._seen = self._game.reset()
        self.steps, self.ending = 0, ""

    def control(self) -> None:
        """One control step, and the decision before it where one is due."""
        if self.steps % self.batch.substeps == 0:
            self._game.act(mean_actions(self._networks, self._seen.observations, self._game.action_sizes))
            self.batch.decide()
        self.batch.control()
        self.steps += 1

    def judge(self) -> None:
        """After each control step: observe, and end the game, where a decision is complete. An ended game restarts."""
        if self.steps % self.batch.substeps:
            return
        self.batch.finish_decision()
        outcome = self._game.outcome()
        self._seen = outcome.observed
        if outcome.terminated[0] or outcome.truncated[0]:
            self.ending = next(name for name in COUNTED[:-1] if outcome.figures[name][0])

    def lines(self) -> tuple[Line, ...]:
        """The path and its walls, on the ground."""
        batch = self.batch
        points, walls = batch.paths.outline(int(batch.drawn.task[0]))
        lines = [(points[::EVERY], PATH)]
        for wall in walls:
            present = np.isfinite(wall[:, 0])
            pieces = np.split(np.arange(len(wall)), np.flatnonzero(np.diff(present)) + 1)
            lines += [(wall[piece][[*range(0, len(piece), EVERY), -1]], WALL) for piece in pieces if present[piece[0]]]
        heading, start = batch.origin.heading[0], batch.origin.position[0, :2]
        moved = [(turned(line, np.full(len(line), heading)) + start, colour) for line, colour in lines]
        return tuple((np.column_stack([line, np.full(len(line), HEIGHT)]), colour) for line, colour in moved)

    def close(self) -> None:
        self._game.close()


def show_game(game: SingleGame) -> None:
    """Play a game from its beginning, in real time in a window. Raises NoDisplay, and Interrupted when it is closed."""
    require_display()
    with in_window(game.lower.simulation, game.lines()) as look:
        _play_to_the_end(game, look)


def film_game(game: SingleGame, path: Path, title: str, progress: Callable[[float, float], None]) -> int:
    """Play a game from its beginning to an mp4 file, without a display; returns the number of frames. `title`: in every
    frame; `progress` receives the rendered and the longest duration [s]. Raises NoRenderer."""
    video = game.recipe.eval.video.model_copy(update={"duration": game.duration})
    with (
        written_film(path, video.fps) as add,
        closing(Filming(game.lower.simulation, add, video, game.lines())) as filming,
    ):

        def look(seconds: float) -> None:
            filming.look(seconds, lambda: [title, _state_line(game, seconds)])
            progress(seconds, game.duration)

        _play_to_the_end(game, look)
        return filming.frames


def _play_to_the_end(game: SingleGame, look: Callable[[float], None]) -> None:
    look(0.0)
    while not game.ending:
        game.control()
        look(game.seconds)
        game.judge()


def _state_line(game: SingleGame, seconds: float) -> str:
    """Time, way along the path, horizontal force of the partner and velocity command of the skill, in words."""
    now, lower = game.batch.now, game.lower
    way = f"{now.covered[0]:.1f} of {now.covered[0] + now.left[0]:.1f} m"
    force = np.linalg.norm(lower.simulation.state.partner_force[0, :2])
    walk = velocity_text(lower.memory.command[0, :3])
    return f"{seconds:4.1f} s   {way}   partner {force:2.0f} N   {walk}"
