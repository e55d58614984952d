"""The feasible map: which pelvis heights the robot reaches at which torso pitch, and how commands are brought into it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

FILE = "feasible.npz"


class EmptyRegion(ValueError):
    """No command of the map has a label."""


@dataclass(frozen=True)
class FeasibleMap:
    """For each pitch of a grid an interval of heights; between the grid's pitches the bounds are interpolated."""

    pitch: Array
    """Pitches that have a feasible height, ascending, shape (columns,) [rad]."""
    lowest: Array
    highest: Array
    """Bounds of the height at each of those pitches, shape (columns,) [m]."""
    grid_height: Array
    """All heights that were tried, shape (heights,) [m]."""
    grid_pitch: Array
    """All pitches that were tried, shape (pitches,) [rad]."""
    kept: Array
    """Whether a command is feasible, shape (heights, pitches)."""

    @classmethod
    def from_grid(cls, height: Array, pitch: Array, kept: Array) -> Self:
        """The largest region of one height interval a pitch, over neighbouring pitches, inside `kept` (heights, pitches).

        Raises EmptyRegion where nothing is kept.
        """
        columns = [_longest_run(column) for column in kept.T]
        start, stop = _longest_run(np.array([last > first for first, last in columns]))
        if stop == start:
            raise EmptyRegion(
                f"no command has a label: heights {height[0]:.3f} to {height[-1]:.3f} m, torso pitches {pitch[0]:.3f} "
                f"to {pitch[-1]:.3f} rad"
            )
        chosen = columns[start:stop]
        return cls(
            pitch=pitch[start:stop],
            lowest=np.array([height[first] for first, _ in chosen]),
            highest=np.array([height[last - 1] for _, last in chosen]),
            grid_height=height,
            grid_pitch=pitch,
            kept=kept,
        )

    def clamp(self, height: Array, pitch: Array) -> tuple[Array, Array]:
        """Heights [m] and pitches [rad], any equal shapes, brought into the map: first the pitch, then the height."""
        pitch = np.clip(pitch, self.pitch[0], self.pitch[-1])
        lowest, highest = np.interp(pitch, self.pitch, self.lowest), np.interp(pitch, self.pitch, self.highest)
        return np.clip(height, lowest, highest), pitch

    def contains(self, height: Array, pitch: Array) -> Array:
        """Which commands the map leaves as they are."""
        kept_height, kept_pitch = self.clamp(height, pitch)
        inside: Array = (kept_height == height) & (kept_pitch == pitch)
        return inside

    def save(self, path: Path) -> None:
        """Writes the map as an npz."""
        with path.open("wb") as stream:
            np.savez_compressed(
                stream,
                pitch=self.pitch,
                lowest=self.lowest,
                highest=self.highest,
                grid_height=self.grid_height,
                grid_pitch=self.grid_pitch,
                kept=self.kept,
            )

    @classmethod
    def load(cls, path: Path) -> Self:
        """Reads what `save` wrote. Raises FileNotFoundError, or ValueError where the file is damaged."""
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no feasible map; run `iowbc run RECIPE --until rg-fit`")
        names = ("pitch", "lowest", "highest", "grid_height", "grid_pitch", "kept")
        try:
            with np.load(path, allow_pickle=False) as arrays:
                loaded = cls(**{name: arrays[name] for name in names})
        except Exception as error:
            raise ValueError(f"{path}: not a feasible map ({error}); run `rg-dataset` again") from error
        bounds = np.stack([loaded.pitch, loaded.lowest, loaded.highest])
        if not np.isfinite(bounds).all() or bounds.shape[1] == 0 or (loaded.lowest > loaded.highest).any():
            raise ValueError(f"{path}: the bounds of the feasible map are empty or not finite; run `rg-dataset` again")
        return loaded


def _longest_run(values: Array) -> tuple[int, int]:
    """First and past-the-end index of the longest run of true values; (0, 0) where there is none."""
    best, start = (0, 0), None
    for index, value in enumerate([*values, False]):
        if value and start is None:
            start = index
        elif not value and start is not None:
            if index - start > best[1] - best[0]:
                best = (start, index)
            start = None
    return best
