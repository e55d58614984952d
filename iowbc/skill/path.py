"""Paths of transport tasks as equidistant points, and projection of objects onto them."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.skill.task import Stretch

SPACING = 0.05
"""Spacing of the points of a path [m]: a tenth of the smallest object."""
WINDOW = 10
"""Half width, in points, of the search window around the last place. No object moves that far in a decision, and the
search cannot jump to another part of a path that passes near itself."""


class Paths:
    """The paths of some tasks, in the frame of the object's centre at the start, x along the robot's heading."""

    def __init__(self, paths: Sequence[Sequence[Stretch]]) -> None:
        built = [_points(path) for path in paths]
        longest = max(len(rows) for rows in built)
        rows = np.stack([np.pad(own, ((0, longest - len(own)), (0, 0)), mode="edge") for own in built])
        self._last = np.array([len(own) - 1 for own in built])
        self.points, self._heading, self._height, self._half_width = rows[..., :2], *np.moveaxis(rows[..., 2:], 2, 0)
        """Points (paths, k, 2) [m]."""
        self.length = np.array([sum(stretch.length for stretch in path) for path in paths])
        """Length of each path, (paths,) [m]."""

    def place(self, path: Indices, position: Array, around: Array) -> tuple[Array, Array]:
        """Projects positions (n, 2) [m] onto paths (n,), near the arc length `around` (n,) [m]: arc length, and
        distance from the path, positive to its left, (n,) [m]."""
        centre = np.round(around / SPACING).astype(np.int64)
        near = (centre[:, None] + np.arange(-WINDOW, WINDOW + 1)).clip(0, self._last[path, None])
        away = position[:, None] - self.points[path[:, None], near]
        nearest = np.vecdot(away, away).argmin(axis=1)
        rows = np.arange(len(path))
        index, away = near[rows, nearest], away[rows, nearest]
        cosine, sine = np.cos(self._heading[path, index]), np.sin(self._heading[path, index])
        covered = index * SPACING + (cosine * away[:, 0] + sine * away[:, 1]).clip(-SPACING, SPACING)
        return covered.clip(0.0, self.length[path]), cosine * away[:, 1] - sine * away[:, 0]

    def heading(self, path: Indices, covered: Array) -> Array:
        """Heading of the path at an arc length, (n,) [rad]; constant beyond its ends."""
        return self._read(self._heading, path, covered)

    def height(self, path: Indices, covered: Array) -> Array:
        """Height of the object's centre above that at the start, (n,) [m]."""
        return self._read(self._height, path, covered)

    def half_width(self, path: Indices, covered: Array) -> Array:
        """Distance of the walls from the path, (n,) [m]; infinite where there are none."""
        index = np.round(covered / SPACING).astype(np.int64).clip(0, self._last[path])
        return self._half_width[path, index]

    def outline(self, path: int) -> tuple[Array, Array]:
        """Points of one path, (k, 2) [m], and of its walls on both sides, (2, k, 2), NaN where there are none."""
        last = self._last[path] + 1
        points, heading, half = self.points[path, :last], self._heading[path, :last], self._half_width[path, :last]
        normal = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        away = np.where(np.isfinite(half), half, np.nan)[:, None] * normal
        return points, np.stack([points + away, points - away])

    def point(self, path: Indices, covered: Array) -> Array:
        """Points at arc lengths along paths, (n, 2) [m]."""
        return np.stack([self._read(self.points[..., axis], path, covered) for axis in (0, 1)], axis=1)

    def curvature(self, path: Indices, covered: Array) -> Array:
        """Change of heading per arc length, (n,) [rad/m]."""
        return (self.heading(path, covered + SPACING) - self.heading(path, covered)) / SPACING

    def _read(self, values: Array, path: Indices, covered: Array) -> Array:
        last = self._last[path]
        at = (covered / SPACING).clip(0.0, last)
        low = np.minimum(at.astype(np.int64), last - 1)
        before, behind = values[path, low], values[path, low + 1]
        return before + (at - low) * (behind - before)


def _points(path: Sequence[Stretch]) -> Array:
    """x, y, heading, height and half width at equal distances, (k, 5)."""
    ends = np.cumsum([0.0, *(stretch.length for stretch in path)])
    count = max(2, round(ends[-1] / SPACING) + 1)
    way = np.arange(count) * SPACING
    heading = np.interp(way, ends, np.cumsum([0.0, *(stretch.turn for stretch in path)]))
    height = np.interp(way, ends, np.cumsum([0.0, *(stretch.rise for stretch in path)]))
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = SPACING * np.stack([np.cos(middle), np.sin(middle)], axis=1)
    points = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    owner = np.searchsorted(ends, way, side="right").clip(1, len(path)) - 1
    half = np.array([np.inf if stretch.width is None else 0.5 * stretch.width for stretch in path])[owner]
    return np.column_stack([points, heading, height, half])
