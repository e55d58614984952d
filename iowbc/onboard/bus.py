"""The bus between a robot and what drives it, whatever carries the messages."""

from typing import Protocol

import numpy as np

from iowbc.onboard.messages import Record


class Bus(Protocol):
    """Publishes messages and takes those of other participants; topics follow from the kinds of messages."""

    def publish(self, message: Record) -> None:
        """Sends a message of any kind."""

    def take(self, kind: np.dtype[np.void]) -> list[Record]:
        """Messages of a kind from others since the last call, oldest first."""

    def wait(self, kind: np.dtype[np.void], seconds: float) -> bool:
        """Waits until there is something to take; False where nothing came in time."""

    def high_level_mode(self, seconds: float) -> str | None:
        """Name of the robot's own controller that is active, "" for none, None where the robot does not answer."""

    def close(self) -> None:
        """Leaves the bus."""
