"""Planned episodes: scene, seed, fixed quantities and scripted commands."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from pydantic import TypeAdapter

from iowbc.task.commands.script import CommandScript


@dataclass(frozen=True)
class PlannedPush:
    """A push on the base at a set time."""

    time: float
    """When it begins [s]."""
    duration: float
    """Time over which it acts, as a constant force [s]."""
    impulse: tuple[float, float]
    """Forward and to the left of the commanded heading [N·s]."""


@dataclass(frozen=True)
class PlannedPull:
    """A sinusoidal force on the object's centre of mass, f sin(2π ν (t - begin))."""

    begin: float
    """[s]."""
    duration: float
    """[s]."""
    frequency: float
    """ν [Hz]."""
    force: tuple[float, float]
    """Amplitude, forward and to the left of the commanded heading [N]."""

    @property
    def direction(self) -> str:
        """The nearer axis: "forward" or "left"."""
        forward, left = self.force
        return "forward" if abs(forward) >= abs(left) else "left"


@dataclass(frozen=True)
class Episode:
    """A trial. Everything random in it follows from its seed, so that every policy meets the same trial."""

    scene: str
    seed: int
    """Seed of all that is drawn in the episode."""
    duration: float
    """Time limit [s]."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Randomised quantities held at a value, by name."""
    script: CommandScript | None = None
    """The commands; None draws them as in training."""
    push: PlannedPush | None = None
    """A push on the base in addition to the drawn ones."""
    pull: PlannedPull | None = None
    """A pull on the object."""

    def __post_init__(self) -> None:
        if self.duration <= 0.0:
            raise ValueError(f"an episode lasts a positive time, got {self.duration} s")
        if self.seed < 0:
            raise ValueError(f"an episode's seed is not negative, got {self.seed}")

    def as_json(self) -> dict[str, Any]:
        return asdict(self) | {"script": None if self.script is None else self.script.as_json()}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> "Episode":
        script = None if values["script"] is None else {"segments": values["script"]}
        return EPISODE.validate_python({**values, "script": script})


EPISODE = TypeAdapter(Episode)
