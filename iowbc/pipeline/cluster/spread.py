"""A stage on a node that lets other nodes work for it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from iowbc.errors import Damaged, Interrupted
from iowbc.pipeline.cluster.folders import Folder, placed
from iowbc.pipeline.cluster.identity import Identity, identity

Result = TypeVar("Result")
TRIES = 5
"""Times that a piece is begun whose node or worker is lost."""
POLL = 0.2
"""Seconds between two looks at the pieces."""


class NodeSpread:
    """Shares pieces of a stage out over the cluster, as tasks of one core each."""

    def __init__(
        self, driver: Identity, folders: Mapping[Path, Folder], interrupted: Callable[[], bool], *, copy: bool
    ) -> None:
        """folders: what the stage reads, by where it lies on this machine."""
        self._driver = driver
        self._folders = folders
        self._interrupted = interrupted
        self._copy = copy

    @property
    def width(self) -> int:
        """Pieces that can run at the same time."""
        import ray

        return max(1, int(ray.cluster_resources().get("CPU", 1)))

    def __call__(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> Iterator[tuple[int, Result]]:
        """Place and result of each call, in the order in which they end; see `Spread`."""
        import ray

        own = {name: self._folders[path] for name, path in folders.items()}
        piece = ray.remote(num_cpus=1, max_retries=TRIES, scheduling_strategy="SPREAD")(_called)
        waiting = {
            piece.remote(self._driver, function, arguments, own, self._copy): place
            for place, arguments in enumerate(calls)
        }
        try:
            while waiting:
                if self._interrupted():
                    raise Interrupted("finished pieces are kept")
                over, _ = ray.wait(list(waiting), timeout=POLL)
                for task in over:
                    yield waiting.pop(task), ray.get(task)
        finally:
            for task in waiting:
                ray.cancel(task, force=True)


def _called(
    driver: Identity,
    function: Callable[..., Result],
    arguments: tuple[Any, ...],
    folders: Mapping[str, Folder],
    copy: bool,
) -> Result:
    """What runs on the node of a piece."""
    import ray

    if different := driver.mismatch(identity()):
        raise Damaged(f"a node is not as the driver: {different}; install the same on both")
    return function(*arguments, **{name: placed(folder, ray.get, copy=copy) for name, folder in folders.items()})
