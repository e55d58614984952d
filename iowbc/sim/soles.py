"""Motion and contact of the soles; computed in trials only."""

from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.model import ModelIndex


class Soles:
    """Motion and contact of the left and right sole in n simulations of one scene."""

    def __init__(
        self, robot: Robot, batch: Any, layout: ModelIndex, wrench: Array, past_force: Array, lightest: float
    ) -> None:
        """`wrench`: torque about the robot's centre of mass and force on each foot from what it touches in the last
        physics step, (n, 2, 6) [N·m, N]; `past_force`: of the ground on each foot in the physics steps of the last
        control period, (n, 2, substeps, 3) [N]; `lightest`: vertical force of a foot in contact [N]."""
        self._layout, self._wrench, self._past_force, self._lightest = layout, wrench, past_force, lightest
        self._spatial, self._subtree_com = batch.bind("cvel"), batch.bind("subtree_com")
        self._sites, self._quaternion = batch.bind("site_xpos"), batch.bind("xquat")
        self._corners = np.zeros((*robot.sole_polygon.shape[:2], 3))
        self._corners[..., :2] = robot.sole_polygon
        self._normals, self._distances = half_planes(robot.sole_polygon)

    def arrays(self) -> dict[str, Array]:
        """All quantities by name, (n, 2) each."""
        loaded, pressure = self._pressure()
        sliding = self._velocity(pressure)  # a foot that rolls over its edge does not slide: this point is at rest
        return {
            "foot_slide": np.hypot(sliding[..., 0], sliding[..., 1]) * loaded,
            "foot_margin": self._margin(loaded, pressure),
            "foot_sink": self._sink(),
            "foot_peak": np.sqrt(np.vecdot(self._past_force, self._past_force).max(axis=2)),
        }

    def _pressure(self) -> tuple[Array, Array]:
        """Contact of each foot, (n, 2), and its centre of pressure from the robot's centre of mass, (n, 2, 3) [m]."""
        torque, force = self._wrench[..., :3], self._wrench[..., 3:]
        loaded = force[..., 2] > self._lightest
        weight = np.where(loaded, force[..., 2], 1.0)
        down = np.broadcast_to(-self._com[..., 2], weight.shape)
        ahead = (down * force[..., 0] - torque[..., 1]) / weight
        left = (down * force[..., 1] + torque[..., 0]) / weight
        return loaded, np.stack([ahead, left, down], axis=-1)

    @property
    def _com(self) -> Array:
        """The robot's centre of mass, (n, 1, 3) [m]."""
        return self._subtree_com[:, self._layout.base][:, None]

    def _velocity(self, place: Array) -> Array:
        """Velocity of points of the feet, given from the robot's centre of mass, (n, 2, 3) [m/s]."""
        spatial = self._spatial[:, self._layout.feet]
        return spatial[..., 3:] + rotations.cross(spatial[..., :3], place)

    def _margin(self, loaded: Array, pressure: Array) -> Array:
        """Distance of the centres of pressure from the edge of the sole [m]; zero in the air. Never negative: forces
        are those of the last physics step, and the sole has moved since."""
        away = pressure + self._com - self._sites[:, self._layout.soles]
        place = rotations.rotate_inverse(self._quaternion[:, self._layout.feet], away)[..., :2]
        margin: Array = np.min(self._distances - np.einsum("fsk,nfk->nfs", self._normals, place), axis=-1)
        return margin.clip(0.0) * loaded

    def _sink(self) -> Array:
        """Downward speed of the lowest corner of each sole [m/s]."""
        turn = self._quaternion[:, self._layout.feet][:, :, None]
        corners = rotations.rotate(turn, np.broadcast_to(self._corners, (len(turn), *self._corners.shape)))
        lowest = corners[..., 2].argmin(axis=2)[..., None, None]
        corner = np.take_along_axis(corners, lowest, axis=2)[:, :, 0]
        return -self._velocity(corner + self._sites[:, self._layout.soles] - self._com)[..., 2]


def half_planes(polygon: Array) -> tuple[Array, Array]:
    """Outward unit normals (..., k, 2) and distances (..., k) of the sides of convex polygons (..., k, 2) [m], whose
    corners are in any order: a point p is inside where n · p ≤ d for all sides."""
    around = polygon - polygon.mean(axis=-2, keepdims=True)
    order = np.argsort(np.arctan2(around[..., 1], around[..., 0]), axis=-1)[..., None]
    corners = np.take_along_axis(polygon, order, axis=-2)
    along = np.roll(corners, -1, axis=-2) - corners
    normals = np.stack([along[..., 1], -along[..., 0]], axis=-1) / np.linalg.norm(along, axis=-1, keepdims=True)
    return normals, np.vecdot(normals, corners)
