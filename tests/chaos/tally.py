"""What a series of disturbances came to, a line of JSON each; a later series goes on from it."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

ENDED = "none, the run came to its end"


@dataclass(frozen=True)
class Turn:
    """One run, and what disturbed it."""

    number: int
    kind: str
    """What happened to the run, or `ENDED`."""
    moment: float
    """When, after its start [s]."""
    lost: tuple[str, ...] = ()
    """What is not there any more, or is another than it should be."""
    tracebacks: tuple[str, ...] = ()
    """What was printed with a traceback, or as an unexpected error."""
    left: tuple[str, ...] = ()
    """Processes that outlived the run."""

    @property
    def findings(self) -> list[str]:
        """All that should not be, in words."""
        named = {"lost": self.lost, "printed": self.tracebacks, "left": self.left}
        return [f"{what}: {text}" for what, texts in named.items() for text in texts]


@dataclass(frozen=True)
class Undisturbed:
    """The run that nothing happened to."""

    seconds: float
    """Time that it took [s]."""
    results: dict[str, str]
    """Digest of each stage's results."""


@dataclass
class Tally:
    """The turns so far, what they are compared with, and the file that keeps both."""

    file: Path
    turns: list[Turn] = field(default_factory=list)
    undisturbed: Undisturbed | None = None

    @classmethod
    def of(cls, file: Path) -> "Tally":
        """What a file has kept; a last line that was cut off does not count."""
        lines = file.read_text(encoding="utf-8").splitlines(keepends=True) if file.is_file() else []
        whole = [line for line in lines if line.endswith("\n")]
        if whole != lines:
            file.write_text("".join(whole), encoding="utf-8")
        head = [Undisturbed(**json.loads(line)) for line in whole[:1]]
        return cls(file, [_turn(json.loads(line)) for line in whole[1:]], head[0] if head else None)

    def begin(self, undisturbed: Undisturbed) -> None:
        """The head of the record."""
        self.undisturbed = undisturbed
        self._write(asdict(undisturbed))

    def add(self, turn: Turn) -> None:
        self._write(asdict(turn))
        self.turns.append(turn)

    def _write(self, told: dict[str, Any]) -> None:
        self.file.parent.mkdir(parents=True, exist_ok=True)
        with self.file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(told) + "\n")

    @property
    def events(self) -> int:
        """Runs that were disturbed."""
        return sum(turn.kind != ENDED for turn in self.turns)

    @property
    def clean(self) -> bool:
        return not any(turn.findings for turn in self.turns)

    @property
    def line(self) -> str:
        """The counts so far, in a few words."""
        lost, tracebacks, left = (sum(len(getattr(turn, name)) for turn in self.turns) for name in COUNTED)
        return f"{self.events} events: lost {lost}, tracebacks {tracebacks}, processes left {left}"

    def table(self) -> str:
        """The counts by kind, in Markdown."""
        rows = ["| kind | count | lost | tracebacks | processes left |", "|---|---|---|---|---|"]
        kinds = sorted({turn.kind for turn in self.turns} - {ENDED})
        for kind in [*kinds, ENDED]:
            rows.append(_row(kind, [turn for turn in self.turns if turn.kind == kind]))
        return "\n".join([*rows, _row("all", self.turns)])


COUNTED = ("lost", "tracebacks", "left")


def _turn(kept: dict[str, Any]) -> Turn:
    given: dict[str, Any] = {name: tuple(item) if isinstance(item, list) else item for name, item in kept.items()}
    return Turn(**given)


def _row(name: str, turns: list[Turn]) -> str:
    sums = [sum(len(getattr(turn, counted)) for turn in turns) for counted in COUNTED]
    return f"| {' | '.join(map(str, (name, len(turns), *sums)))} |"
