"""Numerical precision and threads of the networks during training.

Parts of a minibatch run in our own threads, which synchronize once a minibatch. Torch's synchronize in every layer and
spin: beside another program, an update of one second took two minutes. Results depend on the number of parts alone.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import Literal, TypeVar

import torch
from torch import Tensor

from iowbc.processes import keep_freed_memory

Result = TypeVar("Result")


def prepare_process() -> None:
    """Limit torch to one thread, since more gain little and change the order of rounding; keep freed memory."""
    torch.set_num_threads(1)
    keep_freed_memory()


class ParallelBatch:
    """Parallel evaluation of a function on the parts of a batch."""

    def __init__(self, parts: int, cores: int) -> None:
        """`parts`: number of parts of a batch; `cores`: maximum number of threads."""
        self.parts = parts
        self._pool = None
        if min(parts, cores) > 1:
            self._pool = ThreadPoolExecutor(min(parts, cores), initializer=torch.set_num_threads, initargs=(1,))

    def __call__(self, function: Callable[[Tensor], Result], batch: Tensor) -> list[Result]:
        """Results of the function for each part of a batch of rows, in order."""
        parts: Sequence[Tensor] = torch.tensor_split(batch, self.parts)
        return list(map(function, parts) if self._pool is None else self._pool.map(function, parts))


def reduced(precision: Literal["auto", "float32", "bfloat16"]) -> AbstractContextManager[None]:
    """Context in which layers multiply in bfloat16: if `precision` says so, or for "auto" if the processor can
    (avx512_bf16 or amx); without, it is emulated and slower.

    Torch's cache of converted weights is off: all threads share it and any of them empties it, so that a layer used
    twice would sometimes sum its gradients in bfloat16.
    """
    able = any(torch.cpu.get_capabilities().get(name) for name in ("avx512_bf16", "amx_bf16"))
    wanted = precision == "bfloat16" or (precision == "auto" and able)
    return torch.autocast("cpu", torch.bfloat16, enabled=wanted, cache_enabled=False)
