"""Films of episodes: plays one again from its seed and draws it."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pandas as pd

from iowbc.evaluation.video import Film, with_text
from iowbc.recipe.evaluation import Video
from iowbc.sim.rendering.renderer import SceneRenderer
from iowbc.task.vector.vector_env import VectorEnv

NOT_WORD = str.maketrans({" ": "_", "/": "_"})


def filmed(trials: pd.DataFrame, count: int) -> list[tuple[str, "pd.Series[Any]"]]:
    """The trials to film, with names: the first trial of up to `count` masses, spread over those with an object.

    Without any object, over what there is. A single film is of the middle mass.
    """
    first = trials[trials["trial"] == 0]
    first = first[first["mass"] > 0] if (first["mass"] > 0).any() else first
    ends = (0, len(first) - 1) if count > 1 else ((len(first) - 1) // 2,) * 2
    places = np.linspace(*ends, min(count, len(first))).round().astype(int)
    rows = [first.iloc[place] for place in dict.fromkeys(places.tolist())]
    return [(f"{row['case']}_{row['mass']:g}kg".translate(NOT_WORD), row) for row in rows]


def command_line(signals: dict[str, Any], seconds: float) -> str:
    """Time and command of the first environment, in words."""
    forward, left, turn = signals["commanded_velocity"][0]
    height, pitch = float(signals["height_command"][0, 0]), float(signals["torso_pitch_command"][0, 0])
    walk = f"v {forward:+.2f} {left:+.2f} m/s, turn {turn:+.2f} rad/s"
    return f"{seconds:4.1f} s   {walk}   H {height:.2f} m, pitch {pitch:+.2f} rad"


class EpisodeFilm:
    """A film of the first environment of an in-process vector environment; give `look` to `play_in`."""

    def __init__(self, environment: VectorEnv, path: Path, video: Video, title: Sequence[str]) -> None:
        """`title`: lines of text in every frame, above the line with time and command."""
        self.environment, self.video, self.title = environment, video, list(title)
        self._film = Film(path, video.fps)
        self._renderer: SceneRenderer | None = None
        self.frames = 0

    def look(self, seconds: float) -> None:
        """Draw a frame if one is due at this time [s]."""
        if seconds > self.video.duration or seconds * self.video.fps < self.frames - 1e-6:
            return
        simulation = self.environment.batch.simulation
        if self._renderer is None:
            self._renderer = SceneRenderer(simulation, 0, width=self.video.width, height=self.video.height)
        frame = self._renderer.frame()
        if self.video.traces:
            frame = with_text(frame, [*self.title, command_line(self.environment.signals, seconds)])
        self._film.add(frame)
        self.frames += 1

    def __enter__(self) -> Self:
        self._film.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._renderer is not None:
            self._renderer.close()
        self._film.__exit__(kind, error, trace)
