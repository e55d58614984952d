"""Every error that iowbc raises on purpose. Each text says what is wrong, where, and what to do next.

IowbcError
├── UsageError          what was asked for cannot be done (exit 2)
│   └── RecipeError     a recipe or an override is wrong; holds every problem found
├── StageFailed         a stage's result misses a gate or could not be made (exit 1)
├── PipelineFailed      a run ended at a failed stage (exit 1)
├── Interrupted         asked to stop; what was done is kept (exit 130)
├── Damaged             a file or an artifact is not what was written
├── ContractBroken      an exported folder is incomplete, damaged, or of another format
├── WorkerFailed        a worker process died, hung, or raised
├── NoRenderer          nothing can be drawn on this machine
├── NoDisplay           the viewer needs a display and there is none
└── Rejected            a sample of the reference generator has no label
"""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

REPRESENTATION_LENGTH = 60


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, and where it stands."""

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class IowbcError(Exception):
    """Base of all errors that are raised on purpose."""


class UsageError(IowbcError):
    """What was asked for cannot be done; the text says why, what is valid, and what to do."""


class RecipeError(UsageError):
    """A recipe, or an override of it, is wrong. Holds every problem found."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(map(str, self.problems)))


class StageFailed(IowbcError):
    """A stage found that its result fails a gate or could not be made; the text says what to do next."""


class PipelineFailed(IowbcError):
    """A stage failed; the text names it, the reason, and what to do next."""


class Interrupted(IowbcError):
    """Somebody asked to stop; the text says what is kept."""


class Damaged(IowbcError):
    """A file or an artifact is not what was written. The text says how."""


class ContractBroken(IowbcError):
    """An exported folder is incomplete, damaged, or of another format. The text says what to do."""


class WorkerFailed(IowbcError):
    """A worker process died, hung, or raised; the text holds its traceback. All workers are ended by then."""


class NoRenderer(IowbcError):
    """Nothing can be drawn on this machine. The text says what to install."""


class NoDisplay(IowbcError):
    """The viewer needs a display and there is none. The text says what to do instead."""


class Rejected(IowbcError):
    """A sample has no label; the text is the reason, one of a few words so that they can be counted."""


def nearest(name: str, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the closest known name, or nothing."""
    close = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def shown(value: object) -> str:
    """A value as it is printed in a message, cut to a readable length."""
    text = repr(value)
    return text if len(text) <= REPRESENTATION_LENGTH else text[: REPRESENTATION_LENGTH - 3] + "..."
