"""A stage on a node that lets other nodes work for it."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from iowbc.errors import Damaged, Interrupted
from iowbc.pipeline.cluster.actor_pool import NodeActorPool, Origin
from iowbc.pipeline.cluster.folders import Folder, placed
from iowbc.pipeline.cluster.identity import Identity, identity
from iowbc.pipeline.cluster.stragglers import straggler
from iowbc.pipeline.stage import Member

Result = TypeVar("Result")
TRIES = 5
"""Times that a piece is begun whose node or worker is lost."""
POLL = 0.2
"""Seconds between two looks at the pieces."""


class NodeSpread:
    """Shares pieces of a stage out over the cluster, as tasks of one core each."""

    def __init__(
        self,
        driver: Identity,
        folders: Mapping[Path, Folder],
        interrupted: Callable[[], bool],
        say: Callable[[str], None],
        *,
        copy: bool,
    ) -> None:
        """folders: what the stage reads, by where it lies on this machine. say: is told which node was slow."""
        self._driver = driver
        self._folders = folders
        self._interrupted = interrupted
        self._say = say
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
        took: list[float] = []
        try:
            while waiting:
                if self._interrupted():
                    raise Interrupted("finished pieces are kept")
                over, _ = ray.wait(list(waiting), timeout=POLL)
                for task in over:
                    place = waiting.pop(task)
                    where, seconds, result = ray.get(task)
                    if told := straggler("a piece", where, seconds, took):
                        self._say(told)
                    took.append(seconds)
                    yield place, result
        finally:
            for task in waiting:
                ray.cancel(task, force=True)

    def actor_pool(
        self, called: str, make: Callable[..., Member], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> NodeActorPool:
        """Members of one core each on the nodes; see `Spread`."""
        own = {name: self._folders[path] for name, path in folders.items()}
        return NodeActorPool(called, Origin(self._driver, make, own, self._copy), calls, self._interrupted, self._say)


def _called(
    driver: Identity,
    function: Callable[..., Result],
    arguments: tuple[Any, ...],
    folders: Mapping[str, Folder],
    copy: bool,
) -> tuple[str, float, Result]:
    """What runs on the node of a piece: its name, the time that the piece took [s], and the result."""
    import ray

    own = identity()
    if different := driver.mismatch(own):
        raise Damaged(f"a node is not as the driver: {different}; install the same on both")
    here = {name: placed(folder, ray.get, copy=copy) for name, folder in folders.items()}
    began = time.monotonic()
    result = function(*arguments, **here)
    return own.host, time.monotonic() - began, result
