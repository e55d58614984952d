"""Mouse drags in the browsers: the dragged body, its point, and the pointer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser

from iowbc.arrays import Array

Pushed = Literal["robot", "object"]

STIFFNESS = 150.0
"""Stiffness of the spring between the dragged point and the pointer [N/m]."""
STRONGEST = 300.0
"""Force of that spring at most [N]."""
FARTHEST = 1e3
"""Bound on coordinates of points [m]; a browser's values beyond it are invalid."""


@dataclass(frozen=True)
class Drag:
    """A body that a mouse drags, world frame, (3,) [m]."""

    body: str
    start: Array
    """The dragged point of the body, at the time of the last mouse event."""
    end: Array
    """The pointer, on a plane through that point parallel to the screen."""
    camera: Array
    shift: bool
    """True while the shift key is down."""

    def on_plane(self, height: float) -> Array | None:
        """Intersection of the pointer's ray with the horizontal plane at a height [m], (3,); None without one."""
        down = self.end[2] - self.camera[2]
        part = (height - self.camera[2]) / down if down else -1.0
        point: Array = self.camera + part * (self.end - self.camera)
        return point if part > 0.0 and np.abs(point).max() < FARTHEST else None


def spring_pulls(drags: Sequence[Drag]) -> dict[Pushed, Array]:
    """Bounded spring forces between dragged points and pointers, summed per body, world frame, (3,) each [N]."""
    pulls: dict[Pushed, Array] = {"robot": np.zeros(3), "object": np.zeros(3)}
    for drag in drags:
        force = STIFFNESS * (drag.end - drag.start)
        force *= min(1.0, STRONGEST / max(float(np.linalg.norm(force)), STRONGEST))
        pulls["object" if drag.body == "object" else "robot"] += force
    return pulls


class Drags:
    """Active drags, at most one per browser; it ends when the browser disconnects."""

    def __init__(self) -> None:
        self._held: dict[int, Drag] = {}

    def now(self, away: Array) -> list[Drag]:
        """Active drags in world coordinates, for a view displaced by `away` (3,) [m]."""
        return [
            Drag(drag.body, drag.start + away, drag.end + away, drag.camera + away, drag.shift)
            for drag in list(self._held.values())
        ]

    def follow(self, handle: Any, body: str) -> None:
        """Lets a mesh of a body be dragged. Invalid positions end a drag."""

        async def moved(event: "viser.SceneNodeDragEvent[Any]") -> None:
            """Asynchronous, because only such callbacks run in order."""
            self._held.pop(event.client_id, None)
            places = np.array([event.start_position, event.end_position, event.client.camera.position])
            if event.phase != "end" and (np.abs(places) < FARTHEST).all():
                self._held[event.client_id] = Drag(body, places[0], places[1], places[2], event.modifier is not None)

        for modifier in (None, "shift"):
            handle.on_drag("left", modifier=modifier)(moved)
