"""Every error that iowbc raises on purpose. Each text says what is wrong, where, and what to do next."""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

REPRESENTATION_LENGTH = 60
PROBLEMS_TOLD = 50
"""Problems of a recipe that are reported; the others are counted."""


@dataclass(frozen=True)
class Problem:
    """One problem and its place."""

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class IowbcError(Exception):
    """Base of all errors that are raised on purpose; a command that raises one prints its text."""

    exit_code = 1
    """Exit code of a command that raised it."""


class UsageError(IowbcError):
    """What was asked for cannot be done; the text says why, what is valid, and what to do."""

    exit_code = 2


class RecipeError(UsageError):
    """A recipe, or an override of it, is wrong. Holds the first problems found, and how many more there are."""

    def __init__(self, problems: Sequence[Problem], further: int = 0) -> None:
        """`further`: number of problems beyond those given."""
        self.problems = list(problems[:PROBLEMS_TOLD])
        self.further = further + len(problems) - len(self.problems)
        more = [f"and {self.further:,} more problems"] if self.further else []
        super().__init__("\n".join([*map(str, self.problems), *more]))


class StageFailed(IowbcError):
    """A stage found that its result fails a gate or could not be made; the text says what to do next."""


class PipelineFailed(IowbcError):
    """A stage failed; the text names it, the reason, and what to do next."""


class Interrupted(IowbcError):
    """Stopped by request; the text says what is kept."""

    exit_code = 130


class Damaged(IowbcError):
    """A file or an artifact is not what was written. The text says how."""


class ContractBroken(UsageError):
    """An exported folder is incomplete, damaged, or of another format. The text says what to do."""


class WorkerFailed(IowbcError):
    """A worker process died, hung, or raised; the text holds its traceback, if it left one. All have ended by then."""


class NoRenderer(UsageError):
    """Nothing can be drawn on this machine. The text says what to install."""


class NoDisplay(UsageError):
    """The viewer needs a display and there is none. The text says what to do instead."""


class Rejected(IowbcError):
    """A sample has no label; the text is the reason, one of a few words so that they can be counted."""


def require_known(name: str, what: str, known: Iterable[str]) -> None:
    """Raises `UsageError` with the known names where `name` is not one of them; `what` is a noun: `scene`, `stage`."""
    valid = list(known)
    if name not in valid:
        raise UsageError(f"{name}: no such {what}; valid: {', '.join(valid) or 'none'}{nearest(name, valid)}")


def nearest(name: str, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the closest known name, or nothing."""
    close = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def shown(value: object) -> str:
    """A value as it is printed in a message, cut to a readable length."""
    text = repr(value)
    return text if len(text) <= REPRESENTATION_LENGTH else text[: REPRESENTATION_LENGTH - 3] + "..."
