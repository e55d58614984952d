"""Videos (mp4) of episodes and replayed trials, with lines of text in a corner; several variants side by side."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import imageio.v2
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from iowbc.arrays import Array
from iowbc.evaluation.report.aggregate import case_names
from iowbc.evaluation.trials.metrics import replayed
from iowbc.evaluation.trials.rollout import Outcome, in_batch, play_in, playing
from iowbc.learning.acting import Policy
from iowbc.recipe.evaluation.evaluation import Video
from iowbc.sim.rendering.renderer import Line, SceneRenderer
from iowbc.sim.simulation import Simulation
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

Frame = NDArray[np.uint8]

QUALITY = 7
"""Quality setting of imageio-ffmpeg, 0 to 10; 20 s of 640 x 480 take about 2 MB."""
LINES_PER_FRAME = 26
"""Frame height divided by text height."""
UNSEEN = ("robustness", "pushes", "impedance", "map")
"""Kinds of trials that are not filmed, since they look like others."""
TRIAL = ["suite", "case", "mass", "impulse", "trial"]
"""Columns that identify a trial of a variant."""
NOT_WORD = str.maketrans({" ": "_", "/": "_"})


def with_text(frame: Frame, lines: Sequence[str]) -> Frame:
    """The frame (H, W, 3) with lines of text at the upper left, white on a darkened strip."""
    image = Image.fromarray(frame)
    size = max(10, frame.shape[0] // LINES_PER_FRAME)
    font = ImageFont.load_default(size)
    draw = ImageDraw.Draw(image, "RGBA")
    width = max(draw.textlength(line, font=font) for line in lines)
    draw.rectangle((0, 0, width + size, (len(lines) + 0.5) * size * 1.15), fill=(0, 0, 0, 130))
    for row, line in enumerate(lines):
        draw.text((size / 2, size * (0.2 + 1.15 * row)), line, font=font, fill="white")
    return np.asarray(image)


@contextmanager
def written_film(path: Path, fps: int) -> Iterator[Callable[[Frame], None]]:
    """Yield a function that appends a frame (H, W, 3) to an mp4 file. The file is created if the block succeeds."""
    path.parent.mkdir(parents=True, exist_ok=True)
    settings = {"fps": fps, "codec": "libx264", "quality": QUALITY, "pixelformat": "yuv420p"}
    with TemporaryDirectory(dir=path.parent, prefix=".film-", ignore_cleanup_errors=True) as folder:
        film = Path(folder) / path.name
        # `closing`, since the writer's own context manager leaves the encoder running if the block raises
        with closing(imageio.v2.get_writer(film, format="FFMPEG", **settings)) as writer:
            yield writer.append_data
        film.replace(path)


def filmed(trials: pd.DataFrame, count: int) -> list[tuple[str, "pd.Series[Any]"]]:
    """Trials to film, with names: the first trial of up to `count` cases, evenly spread in order of the table; of a
    single one, the middle case. Only trials with an object if there are any; kinds in `UNSEEN` are excluded."""
    first = trials[(trials["trial"] == 0) & ~trials["kind"].isin(UNSEEN)]
    first = first[first["mass"] > 0] if (first["mass"] > 0).any() else first
    ends = (0, len(first) - 1) if count > 1 else ((len(first) - 1) // 2,) * 2
    places = np.linspace(*ends, min(count, len(first))).round().astype(int)
    names = case_names(first)
    rows = [(names.iloc[place], first.iloc[place]) for place in dict.fromkeys(places.tolist())]
    return [(f"{case}_{row['mass']:g}kg".translate(NOT_WORD), row) for case, row in rows]


class Filming:
    """Passes frames of the first environment of a simulation to a film when they are due. Close it."""

    def __init__(
        self, simulation: Simulation, add: Callable[[Frame], None], video: Video, lines: Sequence[Line] = ()
    ) -> None:
        """`add`: receives the frames; `lines`: on the ground."""
        self._simulation, self._add, self._video, self._lines = simulation, add, video, lines
        self._renderer: SceneRenderer | None = None
        self.frames = 0

    def look(self, seconds: float, text: Callable[[], Sequence[str]]) -> None:
        """Film the state at a time [s] if a frame is due, with lines of text. Raises NoRenderer."""
        video = self._video
        if seconds > video.duration or seconds * video.fps < self.frames - 1e-6:
            return
        if self._renderer is None:
            size = {"width": video.width, "height": video.height}
            self._renderer = SceneRenderer(self._simulation, 0, **size, lines=self._lines)
        frame = self._renderer.frame()
        self._add(with_text(frame, text()) if video.traces else frame)
        self.frames += 1

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()


def velocity_text(velocity: Array) -> str:
    """A velocity command, (3,) [m/s, m/s, rad/s], in words."""
    forward, left, turn = velocity
    return f"v {forward:+.2f} {left:+.2f} m/s, turn {turn:+.2f} rad/s"


def command_line(signals: dict[str, Any], seconds: float) -> str:
    """Time and command of the first environment, in words."""
    height, pitch = float(signals["height_command"][0, 0]), float(signals["torso_pitch_command"][0, 0])
    walk = velocity_text(signals["commanded_velocity"][0])
    return f"{seconds:4.1f} s   {walk}   H {height:.2f} m, pitch {pitch:+.2f} rad"


def film_episode(
    environment: VectorEnv,
    policy: Policy,
    add: Callable[[Frame], None],
    video: Video,
    title: str,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> tuple[Outcome, int]:
    """Play the first episode of an in-process environment and pass its frames to `add`; returns outcome and number of
    frames. `title`: text in every frame, above the line with time and command; `progress` receives the time reached
    [s]. Raises Interrupted when interrupted, NoRenderer if rendering is not possible."""
    with closing(Filming(environment.batch.simulation, add, video)) as filming:

        def look(seconds: float) -> None:
            filming.look(seconds, lambda: [title, command_line(environment.signals, seconds)])

        return play_in(environment, policy, interrupted, progress, look)[0], filming.frames


def film_trial(
    world: Specification,
    policy: Policy,
    row: "pd.Series[Any]",
    add: Callable[[Frame], None],
    video: Video,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> None:
    """Replay the trial in a row of `trials.parquet` and pass its frames to `add`; see `film_episode`."""
    title = f"{row['variant']}: {row['case']}, {row['mass']:g} kg, trial {row['trial']}"
    with playing(world, [replayed(row)]) as environment:
        film_episode(environment, in_batch(policy, row), add, video, title, interrupted, progress)


@dataclass(frozen=True)
class Actor:
    """A variant in the video."""

    world: Specification
    policy: Policy
    trials: pd.DataFrame
    """Its long table."""


def common_trial(actors: Sequence[Actor]) -> list["pd.Series[Any]"]:
    """Rows of all actors for one common trial of the middle mass; empty if they have no trial in common."""
    shared = actors[0].trials
    for actor in actors[1:]:
        shared = shared.merge(actor.trials[TRIAL], on=TRIAL)
    chosen = filmed(shared, 1)
    if not chosen:
        return []
    wanted = chosen[0][1][TRIAL]
    return [actor.trials[(actor.trials[TRIAL] == wanted).all(axis=1)].iloc[0] for actor in actors]


def film_side_by_side(
    actors: Sequence[Actor], rows: Sequence["pd.Series[Any]"], path: Path, progress: Callable[[float, float], None]
) -> None:
    """Replay the trial in each actor's row and film them as tiles; a trial that ends early keeps its last frame.
    `progress` receives the time played in all trials and their total maximum duration [s]. Raises NoRenderer."""
    video = actors[0].world.recipe.eval.video
    with TemporaryDirectory() as place:
        clips: list[list[Path]] = [[] for _ in actors]
        duration, before = sum(float(row["duration"]) for row in rows), 0.0
        for number, (actor, row, clip) in enumerate(zip(actors, rows, clips, strict=True)):

            def keep(frame: Frame, number: int = number, clip: list[Path] = clip) -> None:
                clip.append(Path(place) / f"{number}_{len(clip):06}.png")
                Image.fromarray(frame).save(clip[-1], compress_level=1)

            def further(seconds: float, before: float = before) -> None:
                progress(before + seconds, duration)

            film_trial(actor.world, actor.policy, row, keep, video, progress=further)
            before += float(row["duration"])
            progress(before, duration)
        with written_film(path, video.fps) as add:
            for number in range(max(map(len, clips))):
                add(tiled([np.asarray(Image.open(clip[min(number, len(clip) - 1)])) for clip in clips]))


def tiled(frames: Sequence[Frame]) -> Frame:
    """Frames of one size as one image, in rows of equal length; empty tiles are black."""
    columns = math.ceil(math.sqrt(len(frames)))
    rows = math.ceil(len(frames) / columns)
    empty = [np.zeros_like(frames[0])] * (rows * columns - len(frames))
    tiles = np.stack([*frames, *empty]).reshape(rows, columns, *frames[0].shape)
    return np.concatenate(np.concatenate(tiles, axis=1), axis=1)
