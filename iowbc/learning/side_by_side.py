"""Parts of a minibatch computed side by side: threads of our own, because torch's wait for one another in every layer.

One that waits spins, and where something else runs on its core all of them spin most of the time: an update that takes
a second took two minutes. Here threads meet once a minibatch. Results depend on the parts, not on the threads.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch
from torch import Tensor

from iowbc.processes import keep_freed_memory

Result = TypeVar("Result")


def prepare_process() -> None:
    """One thread for torch in this process: of more, small networks gain little, and round in another order. Freed
    memory is kept for the next arrays."""
    torch.set_num_threads(1)
    keep_freed_memory()


class SideBySide:
    """Computes functions of the parts of a batch on several cores."""

    def __init__(self, parts: int, cores: int) -> None:
        """`parts`: into which a batch is split; `cores`: that are used at most."""
        self.parts = parts
        self._pool = None
        if min(parts, cores) > 1:
            self._pool = ThreadPoolExecutor(min(parts, cores), initializer=torch.set_num_threads, initargs=(1,))

    def __call__(self, function: Callable[[Tensor], Result], batch: Tensor) -> list[Result]:
        """The function of each part of a batch of rows, in their order."""
        parts: Sequence[Tensor] = torch.tensor_split(batch, self.parts)
        return list(map(function, parts) if self._pool is None else self._pool.map(function, parts))
