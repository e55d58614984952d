"""How a recipe's run has ended."""

from dataclasses import dataclass

DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes."""


@dataclass(frozen=True)
class RunEnding:
    """Of one run."""

    code: int
    failure: str = ""
    """Which stage failed and why, in a line; empty where none did."""
