"""Paths of transport tasks as equidistant points, and the state of the games: objects on their paths, start frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.skill.task import Stretch
from iowbc.robot.rotations import rotate, turned, wrapped
from iowbc.sim.simulation import Simulation
from iowbc.task.motion import Motion

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


@dataclass(frozen=True)
class Origin:
    """Start frames, in which paths are defined: the object's centre and the robot's heading at the start."""

    position: Array
    """(n, 3) [m]."""
    heading: Array
    """(n,) [rad]."""

    def turned(self, vectors: Array) -> Array:
        """World vectors (n, 3) or planar ones (n, 2) in these frames."""
        return turned(vectors, -self.heading)


@dataclass(frozen=True)
class GameState:
    """n games at one time; positions and velocities (n, 3) in the start frame, the others (n,); SI units."""

    path: Indices
    """Numbers of the paths, (n,)."""
    position: Array
    """Object's centre."""
    yaw: Array
    yaw_rate: Array
    tilt: Array
    """Of the object; the tilt from upright."""
    handle: Array
    handle_velocity: Array
    """Far handle."""
    heading: Array
    """Heading of the robot."""
    base: Array
    """Pelvis."""
    covered: Array
    """Arc length that the object has covered."""
    lateral: Array
    """Distance of the object from its path, positive to the left."""
    yaw_error: Array
    height_error: Array
    """Yaw and height of the object less the path's heading and height."""
    left: Array
    """Remaining arc length."""


def situation(
    simulation: Simulation, moved: Motion, origin: Origin, paths: Paths, path: Indices, covered: Array
) -> GameState:
    """State after a control step; `covered` (n,): arc length at an earlier time [m]."""
    state = simulation.state
    position = origin.turned(state.object_position - origin.position)
    forward, up = (rotate(state.object_quaternion, np.tile(axis, (simulation.n, 1))) for axis in np.eye(3)[::2])
    yaw = wrapped(np.arctan2(forward[:, 1], forward[:, 0]) - origin.heading)
    covered, lateral = paths.place(path, position[:, :2], covered)
    return GameState(
        path=path,
        position=position,
        yaw=yaw,
        yaw_rate=state.object_angular_velocity[:, 2].copy(),
        tilt=np.arccos(up[:, 2].clip(-1.0, 1.0)),
        handle=origin.turned(simulation.partner.at - origin.position),
        handle_velocity=origin.turned(state.handle_velocity),
        heading=wrapped(moved.heading - origin.heading),
        base=origin.turned(state.base_position - origin.position),
        covered=covered,
        lateral=lateral,
        yaw_error=wrapped(yaw - paths.heading(path, covered)),
        height_error=position[:, 2] - paths.height(path, covered),
        left=paths.length[path] - covered,
    )
