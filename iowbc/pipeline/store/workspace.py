"""The folder of a stage that is being made: scratch, output, and how far it is."""

import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field

from iowbc.files import write_whole
from iowbc.pipeline.store.runs import Runs, read_record

PROGRESS = "progress.json"
Number = Annotated[float, Field(strict=True, gt=-1e18, lt=1e18)]
"""Steps or seconds; the bounds reject damaged values."""
WRITE_INTERVAL = 1.0
"""Seconds between two records of the progress on disk."""


class Progress(BaseModel, ser_json_inf_nan="constants"):
    """Record of a work folder; a number that was not recorded, or whose name a flipped bit changed, is 0."""

    stage: str = "?"
    recipe: str = "?"
    forced: bool = False
    attempts: int = Field(default=0, strict=True, ge=0, lt=10**9)
    before: Number = 0.0
    """Time spent in earlier attempts [s]."""
    seconds: Number = 0.0
    """Time spent over all attempts [s]."""
    updated: Number = 0.0
    """Time of the record [s since 1970]."""
    done: Number = 0.0
    total: Number = 0.0
    note: str = ""
    metric: str = ""
    curve: list[tuple[Number, float]] = Field(default_factory=list)
    """Steps and values of the small curve, named `metric`, over all attempts; a resumed run continues it."""
    code: dict[str, str] = Field(default_factory=dict)
    """Code of the first attempt."""
    command: str = ""
    """Command that resumes it."""

    @property
    def share(self) -> str:
        """The part that is done, in percent; empty where the total is not known."""
        return f"{100 * self.done / self.total:.0f} %" if self.total else ""

    def continues(self, forced: bool, code: Mapping[str, str] | None) -> bool:
        """True if a new attempt continues this one: a forced attempt only a forced one, and one with `code` only what
        was begun with the same code."""
        return (self.forced or not forced) and (code is None or code == self.code)


class Workspace:
    """`runs/work/<key>/`: `scratch/` survives an interruption, `out/` starts empty at each attempt."""

    def __init__(self, runs: Runs, stage: str, key: str) -> None:
        self.stage = stage
        self.key = key
        self.root = runs.work / key
        self.scratch = self.root / "scratch"
        self.out = self.root / "out"
        self.state = Progress(stage=stage)
        """Record of the current attempt."""
        self._begun = self._written = 0.0

    def begin(
        self, recipe: str, forced: bool, code: dict[str, str], command: str = "", *, same_code: bool = False
    ) -> Progress | None:
        """Make room for an attempt; returns the record of the earlier one that it continues. `command`: resumes it when
        it is stopped; `same_code`: continue only what was begun with this code."""
        earlier = read_record(Progress, self.root / PROGRESS)
        if not (earlier or Progress()).continues(forced, code if same_code else None):
            shutil.rmtree(self.root, ignore_errors=True)
            earlier = None
        shutil.rmtree(self.out, ignore_errors=True)
        self.scratch.mkdir(parents=True, exist_ok=True)
        self.out.mkdir()
        self._begun, former = time.monotonic(), earlier or Progress()
        own = {"stage": self.stage, "recipe": recipe, "code": former.code or code, "command": command}
        counted = {"attempts": former.attempts + 1, "before": former.seconds, "forced": forced or former.forced}
        self.state = former.model_copy(update=own | counted)
        self.write()
        return earlier

    @property
    def seconds(self) -> float:
        """Time spent over all attempts [s]."""
        return self.state.before + time.monotonic() - self._begun

    def progress(self, done: float, total: float, note: str) -> None:
        """Update the progress; written to disk at most once per `WRITE_INTERVAL`."""
        self.state.done, self.state.total, self.state.note = done, total, note
        if time.monotonic() - self._written > WRITE_INTERVAL:
            self.write()

    def write(self) -> None:
        self._written = time.monotonic()
        self.state.seconds, self.state.updated = self.seconds, time.time()
        write_whole(self.root / PROGRESS, self.state.model_dump_json())

    @property
    def leftover(self) -> bool:
        """True if the output was moved to the store but the folder was not removed."""
        return self.root.is_dir() and not self.out.is_dir()

    def remove(self) -> None:
        shutil.rmtree(self.root, ignore_errors=True)


def unfinished(runs: Runs) -> list[tuple[Path, Progress]]:
    """Work folders whose output is not in the store yet, and their records, newest first."""
    found = [
        (path, read_record(Progress, path / PROGRESS) or Progress())
        for path in runs.work.glob("[!.]*")
        if path.is_dir() and ((path / "out").is_dir() or not any(runs.store.glob(f"*/{path.name}")))
    ]
    return sorted(found, key=lambda item: -item[1].updated)
