"""Numbers and threads of the networks while they learn.

Parts of a minibatch are computed side by side by threads of our own, because torch's wait for one another in every
layer. One that waits spins, and where something else runs on its core all of them spin most of the time: an update that
takes a second took two minutes. Here threads meet once a minibatch. Results depend on the parts, not on the threads.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import Literal, TypeVar

import torch
from torch import Tensor

from iowbc.processes import keep_freed_memory

Precision = Literal["auto", "float32", "bfloat16"]
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


def has_bfloat16() -> bool:
    """True where the processor multiplies in bfloat16 (avx512_bf16 or amx); without, it is emulated and slower."""
    known = torch.cpu.get_capabilities()
    return bool(known.get("avx512_bf16") or known.get("amx_bf16"))


def reduced(precision: Precision) -> AbstractContextManager[None]:
    """A context in which layers multiply in bfloat16, where the recipe and the processor say so.

    Without torch's cache of converted weights: all threads share it and any of them empties it, so that a layer that is
    used twice would sometimes sum its gradients in bfloat16.
    """
    wanted = precision == "bfloat16" or (precision == "auto" and has_bfloat16())
    return torch.autocast("cpu", torch.bfloat16, enabled=wanted, cache_enabled=False)
