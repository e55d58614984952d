"""In which numbers the networks learn."""

from contextlib import AbstractContextManager
from typing import Literal

import torch

Precision = Literal["auto", "float32", "bfloat16"]


def has_bfloat16() -> bool:
    """Whether the processor multiplies in bfloat16 (avx512_bf16 or amx); without, it is emulated and slower."""
    known = torch.cpu.get_capabilities()
    return bool(known.get("avx512_bf16") or known.get("amx_bf16"))


def reduced(precision: Precision) -> AbstractContextManager[None]:
    """A context in which layers multiply in bfloat16, where the recipe and the processor say so."""
    wanted = precision == "bfloat16" or (precision == "auto" and has_bfloat16())
    context: AbstractContextManager[None] = torch.autocast("cpu", torch.bfloat16, enabled=wanted)
    return context
