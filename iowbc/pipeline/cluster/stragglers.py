"""Who takes much longer than the others, for whatever reason of its node's."""

import statistics
from collections.abc import Sequence

SLOW = 3.0
"""Times the median of the others from which a node is named."""
NOTICEABLE = 1.0
"""Seconds beyond that median below which nobody waits for it: what is short varies by chance."""


def straggler(what: str, host: str, seconds: float, others: Sequence[float]) -> str:
    """What is said of one that took so long [s], with the node it ran on; empty as long as it is as quick as others."""
    usual = statistics.median(others) if others else seconds
    if seconds <= SLOW * usual or seconds - usual <= NOTICEABLE:
        return ""
    return f"{what} took {seconds:.1f} s on {host}, the others {usual:.1f} s"
