"""Where the stages of a command run: in processes here, or on the nodes of a Ray cluster."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from iowbc.pipeline.step import Options
from iowbc.recipe.execution import Execution

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster


@contextmanager
def engine(options: Options, execution: Execution) -> "Iterator[Cluster | None]":
    """The cluster that was asked for, to the end of the block; None where stages run here. Raises `UsageError`."""
    if (options.engine or execution.engine) == "local":
        yield None
        return
    from iowbc.pipeline.cluster.cluster import connected

    with connected(options.address or execution.address, copy=execution.copy_files) as cluster:
        yield cluster
