"""What is wrong with a recipe: where, which key, which value, what would be valid, and the nearest known name."""

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


class UsageError(Exception):
    """What was asked for cannot be done; the text says why, what is valid, and what to do."""


class RecipeError(UsageError):
    """A recipe, or an override of it, is wrong. Holds every problem found."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(map(str, self.problems)))


def nearest(name: str, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the closest known name, or nothing."""
    close = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def shown(value: object) -> str:
    """A value as it is printed in a message, cut to a readable length."""
    text = repr(value)
    return text if len(text) <= REPRESENTATION_LENGTH else text[: REPRESENTATION_LENGTH - 3] + "..."
