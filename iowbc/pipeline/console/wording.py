"""Human-readable time spans, numbers and lists of reasons."""

import time
from collections.abc import Sequence

KEY_LENGTH = 12
"""Characters of a key that are shown."""


def short(reasons: Sequence[str], count: int) -> str:
    """The first few reasons, a line each, and how many more there are."""
    more = len(reasons) - count
    return "\n".join(reasons[:count]) + (f" (and {more} more)" if more > 0 else "")


def duration(seconds: float | None) -> str:
    """A time span for people: `0.4 s`, `42 s`, `12 min`, `3 h 05 min`; empty for None."""
    if seconds is None:
        return ""
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 100:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"


def pace(rate: float | None) -> str:
    """Units a second for people: `4,500/s`, `0.83/s`; empty for None."""
    if rate is None:
        return ""
    return f"{rate:,.0f}/s" if rate >= 100 else f"{rate:.3g}/s"


def ago(moment: float) -> str:
    """Time since a moment [s since 1970], in words; empty for 0."""
    return f"{duration(max(0.0, time.time() - moment))} ago" if moment else ""


def figure(value: float, digits: int = 4, sign: str = "") -> str:
    """A number: `2,402,304` where it is whole or large, else with so many digits; with `sign` "+", also its sign."""
    written_out = value == round(value, 0) or abs(value) >= 1000
    return f"{value:{sign},.0f}" if written_out and abs(value) < 1e12 else f"{value:{sign}.{digits}g}"
