"""The region of (height, pitch) that the robot can hold, to which commands are clamped."""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from iowbc.arrays import Array, Constants, Mask

FEASIBLE = "feasible.npz"
"""File beside a fitted generator with its feasible map, to which the controller clamps commands."""
UPRIGHT = 1e-6
"""Half the width in pitch of the map of an upright torso [rad]; it must not be zero."""
Run = tuple[int, int]
"""First and last place of a row of feasible heights."""


@dataclass(frozen=True)
class FeasibleMap(Constants):
    """For each torso pitch the heights between which every command has a support posture."""

    pitch: Array
    """Pitches, rising, shape (p,) [rad]."""
    low: Array
    high: Array
    """Least and greatest height at each pitch, shape (p,) [m]."""

    def clamp(self, height: Array, pitch: Array) -> tuple[Array, Array]:
        """The command clamped to the region, first the pitch, then the height at that pitch; shapes (n,) [m], [rad]."""
        kept = pitch.clip(self.pitch[0], self.pitch[-1])
        width = self.pitch[1:] - self.pitch[:-1]
        way = (kept[..., None] - self.pitch[:-1]).clip(0.0 * width, width) / width
        low, high = (bound[0] + (way * (bound[1:] - bound[:-1])).sum(-1) for bound in (self.low, self.high))
        return height.clip(low, high), kept

    def up_to(self, pitch: float | None) -> "FeasibleMap":
        """The part of the map with pitches of at most `pitch` [rad]; all of it for None."""
        if pitch is None or pitch >= self.pitch[-1]:
            return self
        kept = np.append(self.pitch[self.pitch < pitch], pitch)
        low, high = np.interp(kept, self.pitch, self.low), np.interp(kept, self.pitch, self.high)
        return FeasibleMap(kept, low, high)

    @classmethod
    def single(cls, height: float) -> "FeasibleMap":
        """The map of an upright torso at one height [m]."""
        pitch = np.array([-UPRIGHT, UPRIGHT])
        return cls(pitch, np.full(2, height), np.full(2, height))

    def contains(self, height: Array, pitch: Array) -> Mask:
        """True where commands are inside, shape (n,)."""
        clamped_height, clamped_pitch = self.clamp(height, pitch)
        return (clamped_height == height) & (clamped_pitch == pitch)

    def save(self, path: Path) -> None:
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


def build_map(
    pitches: Array, heights: Array, feasible: Mask, slope: float, nominal: tuple[float, float]
) -> FeasibleMap:
    """The map from a grid of feasibility flags (pitches, heights), with one run of heights at each pitch.

    It grows from the `nominal` height [m] and pitch [rad] to both sides, each time into the overlapping run nearest to
    the nominal height. Its bounds change with pitch by at most `slope` [m/rad]. Raises ValueError for an empty map.
    """
    runs = [_runs(row) for row in feasible]
    filled = [row for row, found in enumerate(runs) if found]
    if not filled:
        raise ValueError(
            f"the feasible set is empty: none of {feasible.size} commands with heights {heights[0]:.2f} to "
            f"{heights[-1]:.2f} m and pitches {pitches[0]:.2f} to {pitches[-1]:.2f} rad has a gentle label; "
            "widen rg.sampling.height and rg.sampling.pitch"
        )
    start = min(filled, key=lambda row: abs(pitches[row] - nominal[1]))
    place = float(np.interp(nominal[0], heights, np.arange(len(heights))))
    first = min(runs[start], key=lambda run: _distance(run, place))
    above = _grow(first, runs[start + 1 :], place)
    below = _grow(first, runs[:start][::-1], place)[::-1]
    chosen = np.array([*below, first, *above])
    pitch = pitches[start - len(below) : start + len(above) + 1]
    low, high = heights[chosen[:, 0]], heights[chosen[:, 1]]
    reach = slope * np.abs(pitch[:, None] - pitch)
    low, high = (low - reach).max(axis=1), (high + reach).min(axis=1)
    open_rows = _runs(low <= high)
    if not open_rows:
        raise ValueError(f"the feasible set is empty under rg.feasible.bound_slope {slope} m/rad; raise it")
    begin, end = max(open_rows, key=lambda run: run[1] - run[0])
    return FeasibleMap(pitch[begin : end + 1], low[begin : end + 1], high[begin : end + 1])


def _grow(run: Run, rows: list[list[Run]], place: float) -> list[Run]:
    """Follows a run through neighbouring rows for as long as one overlaps, keeping near to a place."""
    followed: list[Run] = []
    for row in rows:
        touching = [other for other in row if min(run[1], other[1]) >= max(run[0], other[0])]
        if not touching:
            break
        run = min(touching, key=lambda other: _distance(other, place))
        followed.append(run)
    return followed


def _runs(row: Mask) -> list[Run]:
    edges = np.diff(np.concatenate([[0], row.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _distance(run: Run, place: float) -> float:
    return max(run[0] - place, place - run[1], 0.0)
