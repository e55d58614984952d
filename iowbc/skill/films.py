"""Films of games: force arrows, and the path and its walls on the ground."""

from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.evaluation.films import with_text, written_film
from iowbc.recipe.evaluation.evaluation import Video
from iowbc.sim.rendering.renderer import SceneRenderer
from iowbc.skill.batch import GameBatch
from iowbc.skill.game import TransportGame, nominal, play_once
from iowbc.skill.plan import Plan
from iowbc.skill.situation import turned
from iowbc.skill.student import Student
from iowbc.task.specification import Specification

PATH, WALL = (0.1, 0.35, 0.8, 1.0), (0.55, 0.2, 0.15, 1.0)
HEIGHT = 0.01
"""Of lines above the ground [m]."""
EVERY = 4
"""Points of a path from one corner of its line to the next: 0.2 m."""
VIEW = -115.0
"""Direction of the view from the path's first heading, to the left of it [degrees]: from its left, past the handle."""


def film_game(specification: Specification, student: Student, plan: Plan, path: Path, video: Video) -> dict[str, Array]:
    """Films the first episode of a planned game with nominal commands into an mp4 file; its figures. Raises NoRenderer
    where nothing can be drawn."""
    with TransportGame(specification, student, n=1, plans=(plan,)) as game, written_film(path, video.fps) as add:
        batch = game.batch
        game.reset()
        simulation = batch.lower.simulation
        azimuth = float(np.degrees(batch.origin.heading[0])) + VIEW
        with SceneRenderer(
            simulation, width=video.width, height=video.height, distance=3.6, azimuth=azimuth, elevation=-22.0
        ) as renderer:
            renderer.lines = path_lines(batch, 0)
            frames = 0

            def watch() -> None:
                nonlocal frames
                seconds = float(batch.lower.memory.steps[0]) * batch.lower.period
                if seconds <= video.duration and seconds * video.fps >= frames:
                    frame = renderer.frame()
                    add(with_text(frame, captions(batch, plan, seconds)) if video.traces else frame)
                    frames += 1

            batch.watch = watch
            return play_once(game, nominal(game))


def captions(batch: GameBatch, plan: Plan, seconds: float) -> list[str]:
    """Lines of text: task and human; time, way covered and the human's horizontal force."""
    goal = "both know the path" if plan.known else "only the human knows the path"
    force = float(np.linalg.norm(batch.lower.simulation.state.partner_force[0, :2]))
    mass = float(batch.lower.simulation.drawn["object_mass"][0])
    way = f"{batch.now.covered[0]:.1f} of {batch.now.covered[0] + batch.now.left[0]:.1f} m"
    return [f"{plan.task}, {mass:.0f} kg, human: {plan.partner}; {goal}", f"{seconds:4.1f} s   {way}   {force:3.0f} N"]


def path_lines(batch: GameBatch, game: int) -> list[tuple[Array, tuple[float, ...]]]:
    """The path of one game and its walls in the world, points (k, 3) [m] with a colour each."""
    points, walls = batch.paths.outline(int(batch.drawn.task[game]))
    lines = [(points[::EVERY], PATH)]
    for wall in walls:
        present = np.isfinite(wall[:, 0])
        pieces = np.split(np.arange(len(wall)), np.flatnonzero(np.diff(present)) + 1)
        lines += [(wall[piece][[*range(0, len(piece), EVERY), -1]], WALL) for piece in pieces if present[piece[0]]]
    heading, start = batch.origin.heading[game], batch.origin.position[game, :2]
    moved = [(turned(line, np.full(len(line), heading)) + start, colour) for line, colour in lines]
    return [(np.column_stack([line, np.full(len(line), HEIGHT)]), colour) for line, colour in moved]
