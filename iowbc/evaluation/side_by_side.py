"""Video of several variants on the same trial, side by side."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import imageio.v3 as iio
import numpy as np
import pandas as pd
from PIL import Image

from iowbc.evaluation.films import Frame, film_trial, filmed, written_film
from iowbc.learning.acting import Policy
from iowbc.task.specification import Specification

TRIAL = ["suite", "case", "mass", "impulse", "trial"]
"""Columns that identify a trial of a variant."""


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
                add(tiled([iio.imread(clip[min(number, len(clip) - 1)]) for clip in clips]))


def tiled(frames: Sequence[Frame]) -> Frame:
    """Frames of one size as one image, in rows of equal length; empty tiles are black."""
    columns = math.ceil(math.sqrt(len(frames)))
    rows = math.ceil(len(frames) / columns)
    empty = [np.zeros_like(frames[0])] * (rows * columns - len(frames))
    tiles = np.stack([*frames, *empty]).reshape(rows, columns, *frames[0].shape)
    return np.concatenate(np.concatenate(tiles, axis=1), axis=1)
