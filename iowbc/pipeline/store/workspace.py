"""The folder of a stage that is being made: scratch, output, and how far it is."""

import json
import os
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from iowbc.files import write_whole
from iowbc.pipeline.machine import host
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE
from iowbc.pipeline.store.runs import Runs

PROGRESS = "progress.json"
Number = Annotated[float, Field(strict=True, gt=-1e18, lt=1e18)]
"""Steps or seconds, of which there are not so many."""
WRITE_INTERVAL = 1.0
"""Seconds between two records of the progress on disk."""


class Progress(BaseModel):
    """Record of a work folder; a number that was not recorded, or whose name a flipped bit changed, is 0."""

    model_config = ConfigDict(extra="allow")

    attempts: int = Field(default=0, strict=True, ge=0, lt=10**9)
    before: Number = 0.0
    """Time spent in earlier attempts [s]."""
    seconds: Number = 0.0
    """Time spent over all attempts [s]."""
    updated: Number = 0.0
    """Time of the record [s since 1970]."""
    done: Number = 0.0
    total: Number = 0.0
    curve: list[tuple[Number, float]] = Field(default_factory=list)
    """Steps and values of the small curve."""
    code: dict[str, str] = Field(default_factory=dict)


class Workspace:
    """`runs/work/<key>/`: `scratch/` survives an interruption, `out/` starts empty at each attempt."""

    def __init__(self, runs: Runs, stage: str, key: str) -> None:
        self.stage = stage
        self.key = key
        self.root = runs.work / key
        self.scratch = self.root / "scratch"
        self.out = self.root / "out"
        self._state: dict[str, Any] = {}
        self._begun = 0.0
        self._written = 0.0

    @property
    def record(self) -> dict[str, Any]:
        """Record of the last attempt; empty where there was none."""
        return _record(self.root)

    def begin(self, recipe: str, forced: bool, code: dict[str, str], command: str = "") -> bool:
        """Make room for an attempt; returns whether it continues an earlier one.

        A forced attempt continues only one that was forced too. `command`: what goes on with it when it is stopped.
        """
        earlier = self.record
        if forced and not earlier.get("forced"):
            shutil.rmtree(self.root, ignore_errors=True)
            earlier = {}
        shutil.rmtree(self.out, ignore_errors=True)
        self.scratch.mkdir(parents=True, exist_ok=True)
        self.out.mkdir()
        self._begun = time.monotonic()
        self._state = {
            "stage": self.stage,
            "key": self.key,
            "recipe": recipe,
            "pid": os.getpid(),
            "host": host(),
            "forced": forced or bool(earlier.get("forced")),
            "attempts": int(earlier.get("attempts", 0)) + 1,
            "before": float(earlier.get("seconds", 0.0)),
            "seconds": float(earlier.get("seconds", 0.0)),
            "metric": str(earlier.get("metric", "")),
            "curve": earlier.get("curve", []),
            **{name: earlier[name] for name in ("done", "total", "note") if name in earlier},
            "code": code,
            "command": command,
        }
        self.write()
        return bool(earlier)

    def describe(self, ingredients: Mapping[str, Any], recipe: str) -> None:
        """Write what the key was computed from, and the recipe, as the artifact will have them beside it."""
        write_whole(self.root / INGREDIENTS, json.dumps(ingredients, indent=1, sort_keys=True))
        write_whole(self.root / RECIPE, recipe)

    @property
    def attempts(self) -> int:
        """Attempts so far, with this one."""
        return int(self._state["attempts"])

    @property
    def seconds(self) -> float:
        """Time spent over all attempts [s]."""
        return float(self._state["before"]) + time.monotonic() - self._begun

    def progress(self, done: float, total: float, note: str) -> None:
        """Record how far the stage is, at most once in a while."""
        self._state.update(done=done, total=total, note=note)
        if time.monotonic() - self._written > WRITE_INTERVAL:
            self.write()

    def drawn(self, metric: str, curve: Sequence[tuple[float, float]]) -> None:
        """Keep the stage's small curve of steps and values for the next record: a resumed run goes on with it."""
        self._state.update(metric=metric, curve=curve)

    @property
    def curve(self) -> tuple[str, list[tuple[float, float]]]:
        """Name, steps and values of the small curve up to now, over all attempts."""
        return str(self._state["metric"]), [(step, value) for step, value in self._state["curve"]]

    def write(self) -> None:
        """Record the progress on disk."""
        self._written = time.monotonic()
        self._state.update(seconds=self.seconds, updated=time.time())
        write_whole(self.root / PROGRESS, json.dumps(self._state))

    @property
    def leftover(self) -> bool:
        """True where the output has gone to the store and the rest stayed."""
        return self.root.is_dir() and not self.out.is_dir()

    def remove(self) -> None:
        """Remove scratch, checkpoints and leftovers."""
        shutil.rmtree(self.root, ignore_errors=True)


def _record(root: Path) -> dict[str, Any]:
    """`Progress` of a work folder; empty where that is missing or not as it was written."""
    try:
        return Progress.model_validate_json((root / PROGRESS).read_bytes()).model_dump()
    except (OSError, ValueError):
        return {}


def _finished(runs: Runs, root: Path) -> bool:
    """True where the output of a work folder is in the store already."""
    return not (root / "out").is_dir() and any(runs.store.glob(f"*/{root.name}"))


def unfinished(runs: Runs) -> list[tuple[Path, dict[str, Any]]]:
    """Work folders and their records, newest first."""
    found = [(path, _record(path)) for path in runs.work.glob("*") if path.is_dir() and not _finished(runs, path)]
    return sorted(found, key=lambda item: -float(item[1].get("updated", 0.0)))
