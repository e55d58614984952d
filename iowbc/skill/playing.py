"""Playback of one game of a trained skill, in MuJoCo's viewer in real time or as a video file."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from iowbc.evaluation.films import Filming, velocity_text, written_film
from iowbc.evaluation.play import in_window, require_display
from iowbc.skill.single_game import SingleGame


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
