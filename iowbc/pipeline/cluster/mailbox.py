"""Where tasks and driver leave word for each other: an actor beside the driver."""

from typing import Any

Event = tuple[Any, ...]
"""`("metrics", values, step)`, `("progress", done, total, note)`, `("say", text)`, `("files", files)` of scratch,
or `("shown", name)` of one of them that tracking is to have."""


class Mailbox:
    """What each task has told since the driver last asked, and which tasks are to stop."""

    def __init__(self) -> None:
        self._told: dict[str, list[Event]] = {}
        self._stopping: set[str] = set()

    def tell(self, task: str, events: list[Event]) -> bool:
        """A task tells how it goes; whether it is to stop after a checkpoint."""
        self._told.setdefault(task, []).extend(events)
        return task in self._stopping

    def collect(self, task: str) -> list[Event]:
        """What a task has told."""
        return self._told.pop(task, [])

    def stop(self, task: str) -> None:
        """Let a task stop after a checkpoint."""
        self._stopping.add(task)
