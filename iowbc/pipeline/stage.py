"""A stage: its declaration, and the job that it receives."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from iowbc.recipe.recipe import Recipe

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.spread import NodeSpread

SUMMARY = "summary.json"
"""File of an artifact with its metrics."""
START = "start"
"""Input name of the artifact that a stage starts from; see `Stage.borrows`."""


class Report(Protocol):
    """A stage's way to console and tracking."""

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Record named values at a step; one batched tracking call."""

    def progress(self, done: float, total: float, note: str = "") -> None:
        """Report progress, in units of the stage (samples, environment steps, trials)."""

    def say(self, text: str) -> None:
        """Print one line."""


@dataclass(frozen=True)
class Job:
    """One execution of a stage."""

    recipe: Recipe
    key: str
    """The artifact's key; checkpoints in `work` are bound to it."""
    robot: Path
    """The robot's folder."""
    inputs: Mapping[str, Path]
    """Artifact folder of each stage that this one reads."""
    out: Path
    """The artifact is written here; published by the runner when `run` returns."""
    work: Path
    """Scratch and checkpoints; survives an interruption, removed after publishing."""
    workers: int
    """Worker processes to use; never changes a result."""
    report: Report
    interrupted: Callable[[], bool]
    """True once the user asked to stop: write a checkpoint and raise `Interrupted`."""
    predecessor: Path | None = None
    """Folder of an artifact of the same stage that this job continues; see `Stage.extends`."""
    spread: "NodeSpread | None" = None
    """Other machines that may work for the stage; never changes a result."""

    def summarize(self, metrics: Mapping[str, float], **details: Any) -> None:
        """Write `summary.json`: metrics, shown wherever the artifact is listed, and details."""
        text = json.dumps({"metrics": dict(metrics), **details}, indent=1) + "\n"
        (self.out / SUMMARY).write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class ExternalInput:
    """An artifact that another recipe makes."""

    path: str
    """Dotted recipe path of the value that names it."""
    named: str
    """That value: a recipe's file, or the beginning of a key."""
    stage: str
    """Stage that makes it."""


@dataclass(frozen=True)
class Stage:
    """A step of the pipeline: what makes its key, and the function that does the work."""

    name: str
    version: int
    """Raised when the same recipe would give a different artifact."""
    slice: tuple[str, ...]
    """Dotted recipe paths that decide the result."""
    reads: Callable[[Recipe], tuple[str, ...]]
    """Names of the stages whose artifacts this one reads, for a given recipe."""
    run: Callable[[Job], None]
    results: tuple[str, ...] = ("*",)
    """Patterns of the files that later stages depend on, identical for the same key. All other files are records:
    curves, times, pictures."""
    problems: Callable[[Recipe], Iterator[tuple[str, str]]] = lambda recipe: iter(())
    """Requests of a recipe that this stage cannot fulfil, known before it runs: dotted paths, and the problem there."""
    defaults: Callable[[Recipe], Mapping[str, Any]] = lambda recipe: {}
    """Values of the program that decide the result where a recipe has none: JSON data by dotted path, for the key."""
    extends: str | None = None
    """Dotted recipe path of a number that only says where the work ends: the stage goes on from an artifact that
    differs in nothing but a smaller one, as if it had never stopped."""
    extends_from: tuple[str, ...] = ()
    """Files needed to continue that artifact; if a published one lacks any, the stage starts from the beginning."""
    borrows: Callable[[Recipe], Mapping[str, ExternalInput]] = lambda recipe: {}
    """Artifacts that other recipes make, by their names among the job's inputs, for a given recipe."""
    counts: tuple[str, ...] = ()
    """Dotted recipe paths of numbers that the time it takes is proportional to."""
    headline: tuple[str, ...] = ()
    """Patterns of the metrics that are shown at the end of a run, the most telling first; `show` has all."""
    columns: tuple[str, ...] = ()
    """Metrics that are columns of MLflow's page."""
    pictures: tuple[str, ...] = ()
    """Names of figures that a report shows at once; all others can be unfolded."""
    curves: tuple[str, ...] = ()
    """Learning curves that a report always shows; all others can be unfolded."""
    trained_by: str = ""
    """Name of the method whose steps the first path of `counts` counts; empty for a stage that does not train."""
    leaves_policy: bool = False
    """True where its artifact holds a policy that can be played."""
    spreads: Callable[[Recipe], bool] = lambda recipe: False
    """True for a recipe whose heavy work runs on `Job.spread`, if there is one."""

    def key_values(self, recipe: Recipe, deciding: Mapping[str, Any]) -> dict[str, Any]:
        """Recipe values that determine the result, and the built-in `defaults`, by dotted path."""
        return {path: slice_value(deciding, path, self) for path in self.slice} | dict(self.defaults(recipe))


def slice_value(values: Mapping[str, Any], path: str, stage: Stage) -> Any:
    """The value at a dotted path; raises ValueError for a path that must not be, or is not, in keys."""
    if path.split(".")[0] in ("execution", "stages"):
        raise ValueError(f"stage {stage.name}: '{path}' must not be part of a key")
    value: Any = values
    for part in path.split("."):
        if not isinstance(value, Mapping) or part not in value:
            raise ValueError(f"stage {stage.name}: its slice names '{path}', which decides nothing in a recipe")
        value = value[part]
    return value
