"""Jobs for tests that run a stage, and a report that keeps what it is told."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from iowbc.pipeline.stage import Job
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder


@dataclass
class Heard:
    """A report that keeps what it is told."""

    rows: list[tuple[int, dict[str, float]]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        assert all(isinstance(value, float) and math.isfinite(value) for value in values.values()), values
        self.rows.append((step, dict(values)))

    def progress(self, done: float, total: float, note: str = "") -> None:
        assert 0 <= done <= total

    def say(self, text: str) -> None:
        self.lines.append(text)


class Backwards:
    """Stands for other machines: makes each call here, the last one first."""

    width = 2

    def __init__(self) -> None:
        self.calls = 0
        self.pools: list[int] = []

    def __call__(
        self, function: Callable[..., Any], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> Iterator[tuple[int, Any]]:
        for place in reversed(range(len(calls))):
            self.calls += 1
            yield place, function(*calls[place], **folders)

    def actor_pool(
        self, called: str, make: Callable[..., Any], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> "Remade":
        self.pools.append(len(calls))
        return Remade([partial(make, *own, **folders) for own in calls])


class Remade:
    """Stands for members on other machines that are lost all the time: before each request every one is made anew."""

    def __init__(self, made: Sequence[Callable[[], Any]]) -> None:
        self.made = made
        self.states: list[Any] = [None for _ in made]
        self.found: list[Any] = []

    def ask(self, messages: Sequence[Any], *, changes: bool = True) -> None:
        self.found = []
        for index, (make, own) in enumerate(zip(self.made, messages, strict=True)):
            member = make()
            if self.states[index] is not None:
                member.restore(self.states[index])
            self.found.append(member.ask(own))
            if changes:
                self.states[index] = member.state()

    def answers(self) -> list[Any]:
        return self.found

    def close(self) -> None:
        self.made = ()


def make_job(
    folder: Path,
    recipe: Recipe,
    *,
    inputs: Mapping[str, Path] | None = None,
    workers: int = 1,
    key: str = "key",
    interrupted: Callable[[], bool] = lambda: False,
) -> Job:
    """A job in `folder`; another one in the same folder goes on where that one stopped."""
    for name in ("out", "work"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    return Job(
        recipe=recipe,
        key=key,
        robot=robot_folder(recipe.robot),
        inputs=inputs or {},
        out=folder / "out",
        work=folder / "work",
        workers=workers,
        report=Heard(),
        interrupted=interrupted,
    )
