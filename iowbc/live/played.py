"""Episodes of a page: the interface of the driven policy and of the game."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Self

from iowbc.live.drag import Drag
from iowbc.live.drawing import GameMarks
from iowbc.live.track import Track
from iowbc.robot.description import Robot

PAST = 60.0
"""Length of the past of an episode that is kept, and can be looked at [s]."""


class Played(ABC):
    """Episodes for a page. Close it, or use it as a context manager."""

    track: Track
    """The present episode, with what is remembered of it."""
    request: Any
    """The conditions of the episode, as `begin` takes them."""
    robot: Robot
    period: float
    """Time of a step [s]."""
    marks: GameMarks | None = None
    """Path, walls and handle of a game."""
    view: tuple[tuple[float, ...], tuple[float, ...]] = ((1.7, -1.4, 1.2), (0.1, 0.0, 0.6))
    """First position of a camera, and at what it looks [m]."""
    checkpoint = ""
    """Which checkpoint of a training plays."""

    @abstractmethod
    def begin(self, request: Any) -> None:
        """A new episode under other conditions."""

    @abstractmethod
    def reset(self) -> None:
        """The episode from its start."""

    @abstractmethod
    def step(self) -> None:
        """One control period. After an episode's end, told in `track.ending`, nothing moves until a reset."""

    @abstractmethod
    def drag(self, drags: Sequence[Drag]) -> None:
        """Takes notice of what mice drag until the next call."""

    @abstractmethod
    def close(self) -> None:
        """Ends the simulation."""

    def refresh(self) -> bool:
        """Takes the newest checkpoint, if the policy is one and was written again; whether it was."""
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *ended: object) -> None:
        self.close()
