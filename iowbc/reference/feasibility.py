"""The region of (height, pitch) that the robot can hold, to which commands are clamped."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class FeasibleMap:
    """For each torso pitch the heights between which every command has a support posture."""

    pitch: Array
    """Pitches, rising, shape (p,) [rad]."""
    low: Array
    high: Array
    """Least and greatest height at each pitch, shape (p,) [m]."""

    def clamp(self, height: Array, pitch: Array) -> tuple[Array, Array]:
        """The command brought into the region, first the pitch, then the height at it; shapes (n,) [m], [rad]."""
        kept = np.clip(pitch, self.pitch[0], self.pitch[-1])
        low, high = np.interp(kept, self.pitch, self.low), np.interp(kept, self.pitch, self.high)
        return np.clip(height, low, high), kept

    def contains(self, height: Array, pitch: Array) -> NDArray[np.bool_]:
        """Whether commands are inside, shape (n,)."""
        clamped_height, clamped_pitch = self.clamp(height, pitch)
        inside: NDArray[np.bool_] = (clamped_height == height) & (clamped_pitch == pitch)
        return inside

    def save(self, path: Path) -> None:
        """Writes plain arrays."""
        np.savez(path, allow_pickle=False, pitch=self.pitch, low=self.low, high=self.high)

    @classmethod
    def load(cls, path: Path) -> "FeasibleMap":
        """Reads the map. Raises FileNotFoundError, or ValueError where it is damaged."""
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                arrays = [np.asarray(stored[name], dtype=np.float64) for name in ("pitch", "low", "high")]
        except FileNotFoundError as error:
            raise FileNotFoundError(f"{path}: no feasible map; run `iowbc run RECIPE --until rg-fit`") from error
        except (ValueError, KeyError, EOFError, BadZipFile) as error:
            raise ValueError(f"{path}: not a feasible map ({error}); make it anew with `--force rg-dataset`") from error
        found = cls(*arrays)
        shapes = {values.shape for values in arrays}
        if len(shapes) != 1 or not all(np.isfinite(values).all() for values in arrays) or not len(found.pitch):
            raise ValueError(f"{path}: not a feasible map; make it anew with `--force rg-dataset`")
        if (np.diff(found.pitch) <= 0).any() or (found.low > found.high).any():
            raise ValueError(f"{path}: pitches must rise and low not pass high; make it anew with `--force rg-dataset`")
        return found


def build_map(pitches: Array, heights: Array, feasible: NDArray[np.bool_], slope: float) -> FeasibleMap:
    """The map of a grid of decisions (pitches, heights): the longest run of heights at each pitch, and of pitches.

    Its bounds change with pitch by at most `slope` [m/rad]. Raises ValueError when no cell is feasible.
    """
    runs = [_longest_run(row) for row in feasible]
    rows = _longest_run(np.array([run is not None for run in runs]))
    if rows is None:
        raise ValueError(
            f"the feasible set is empty: none of {feasible.size} commands with heights {heights[0]:.2f} to "
            f"{heights[-1]:.2f} m and pitches {pitches[0]:.2f} to {pitches[-1]:.2f} rad has a gentle label; "
            "widen rg.sampling.height and rg.sampling.pitch"
        )
    chosen = [(pitches[i], heights[run[0]], heights[run[1]]) for i in range(rows[0], rows[1] + 1) if (run := runs[i])]
    pitch, low, high = np.array(chosen).T
    reach = slope * np.abs(pitch[:, None] - pitch)
    low, high = (low - reach).max(axis=1), (high + reach).min(axis=1)
    span = _longest_run(low <= high)
    if span is None:
        raise ValueError(f"the feasible set is empty under rg.feasible.bound_slope {slope} m/rad; raise it")
    chosen_rows = slice(span[0], span[1] + 1)
    return FeasibleMap(pitch[chosen_rows], low[chosen_rows], high[chosen_rows])


def _longest_run(row: NDArray[np.bool_]) -> tuple[int, int] | None:
    """First and last place of the longest run of True."""
    edges = np.diff(np.concatenate([[0], row.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if not len(starts):
        return None
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best]) - 1
