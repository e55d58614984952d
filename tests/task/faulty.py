"""A request that makes the steps of a group's batch fail, hang or dawdle."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class StepBy:
    """Let each step of the batches of a worker process be a call of this function."""

    function: Callable[[], Any]
    changes: ClassVar[bool] = False

    def carry_out(self, batch: Any) -> None:
        type(batch).step = lambda batch: self.function()
