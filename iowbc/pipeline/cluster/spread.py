"""Work of a stage that other nodes do: calls of functions, and actors."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from iowbc.errors import Interrupted
from iowbc.pipeline.cluster.actor_pool import NodeActorPool
from iowbc.pipeline.cluster.folders import SharedFolder, placed
from iowbc.pipeline.stage import Member

Result = TypeVar("Result")
TRIES = 5
"""Retries by Ray of a call whose node or worker is lost."""
POLL = 0.2
"""Seconds between two looks at the calls."""


class NodeSpread:
    """The nodes of the cluster as a stage uses them."""

    def __init__(
        self, folders: Mapping[Path, SharedFolder], interrupted: Callable[[], bool], say: Callable[[str], None]
    ) -> None:
        """folders: what the stage reads, by its place on this machine. say: prints a line about lost actors."""
        self._folders, self._interrupted, self._say = folders, interrupted, say

    @property
    def width(self) -> int:
        """Calls that can run at the same time."""
        import ray

        return max(1, int(ray.cluster_resources().get("CPU", 1)))

    def __call__(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> Iterator[tuple[int, Result]]:
        """Call a function of a module with each of these arguments, on any node, one core each; place and result of
        each call, in the order in which they end. `folders`: what the job reads, passed by name as paths on the node.

        Raises `Interrupted` once the job is asked to stop.
        """
        import ray

        own = {name: self._folders[path] for name, path in folders.items()}
        piece = ray.remote(num_cpus=1, max_retries=TRIES, scheduling_strategy="SPREAD")(_called)
        waiting = {piece.remote(function, arguments, own): place for place, arguments in enumerate(calls)}
        try:
            while waiting:
                if self._interrupted():
                    raise Interrupted("finished pieces are kept")
                for task in ray.wait(list(waiting), timeout=POLL)[0]:
                    yield waiting.pop(task), ray.get(task)
        finally:
            for task in waiting:
                ray.cancel(task, force=True)

    def actor_pool(
        self, called: str, make: Callable[..., Member], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> NodeActorPool:
        """Members on any nodes, made by a function of a module from each of these arguments and
        `folders`, as above. `called`: the members' name in messages."""
        own = {name: self._folders[path] for name, path in folders.items()}
        return NodeActorPool(called, make, calls, own, self._interrupted, self._say)


def _called(function: Callable[..., Result], arguments: tuple[Any, ...], folders: Mapping[str, SharedFolder]) -> Result:
    return function(*arguments, **{name: placed(folder) for name, folder in folders.items()})
