"""A folder with a small recipe, in which runs go on in this process or in processes of their own."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import fake_stages

from iowbc.files import read_checked
from iowbc.pipeline.console.display import Display, StageView
from iowbc.pipeline.planner import Planner, planner_for
from iowbc.pipeline.runner import Runner
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stage_plan import Options, StagePlan
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import Runs, read_json
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import load_recipe

COMMAND = Path(fake_stages.__file__)
SLOW = {"teacher": {"steps": 120, "pause": 0.05}}  # to be disturbed, with time for a slow machine to do so
RECIPE = "seed: 3\nteacher:\n  steps: 4096\nexecution: {track: false, line_interval: 0.1}\n"


class SilentDisplay(Display):
    """Remembers what would be shown."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.states: list[str] = []

    def changed(self, view: StageView) -> None:
        self.states.append(f"{view.name} {view.state}")

    def say(self, text: str) -> None:
        self.lines.append(text)


@dataclass
class Workplace:
    """A folder with a recipe, a robot, and `runs/`."""

    folder: Path
    registry: dict[str, Stage] = field(default_factory=lambda: dict(fake_stages.STAGES))
    display: SilentDisplay = field(default_factory=SilentDisplay)
    numbers: Iterator[int] = field(default_factory=itertools.count)

    @property
    def recipe(self) -> Path:
        return self.folder / "small.yaml"

    @property
    def store(self) -> Store:
        return Store(Runs(self.folder / "runs"))

    @property
    def robot(self) -> Path:
        return self.folder / "robots" / "g1"

    def planner(self, *overrides: str, **options: Any) -> Planner:
        loaded = load_recipe(self.recipe, overrides)
        return planner_for(loaded, self.registry, self.store, self.robot, Options(**options))

    def plan(self, *overrides: str, **options: Any) -> dict[str, StagePlan]:
        return {step.stage.name: step for step in self.planner(*overrides, **options).plan()}

    def run(
        self, *overrides: str, interrupted: Callable[[], bool] = lambda: False, **options: Any
    ) -> dict[str, Artifact]:
        """Run in this process, without MLflow."""
        runner = Runner(self.planner(*overrides, **options), self.display, None, interrupted)
        return runner.run()

    def ran(self) -> list[str]:
        """Stages that have run since the last call."""
        found = [state.split()[0] for state in self.display.states if state.endswith(" runs")]
        self.display.states.clear()
        return found

    def start(self, *arguments: str, behaviour: dict[str, Any] | None = None, **environment: str) -> "Command":
        """Start the command line on the small stages in a process of its own."""
        words = [sys.executable, str(COMMAND), *arguments]
        settings = {**os.environ, "FAKE_BEHAVIOUR": json.dumps(behaviour or {}), "COLUMNS": "200", **environment}
        paths = [self.folder / f"{next(self.numbers)}.txt" for _ in range(2)]
        with paths[0].open("w") as output, paths[1].open("w") as errors:
            process = subprocess.Popen(words, cwd=self.folder, env=settings, stdout=output, stderr=errors)
        return Command(process, *paths)

    def command(self, *arguments: str, **settings: Any) -> "Command":
        """Run the command line to its end."""
        command = self.start(*arguments, **settings)
        command.finish()
        return command

    def progress(self, stage: str) -> dict[str, Any] | None:
        """What the unfinished stage has recorded, None before it begins."""
        for path in (self.folder / "runs" / "work").glob("*/progress.json"):
            record = read_json(path)
            if record and record["stage"] == stage:
                content = read_checked(path.parent / "scratch" / fake_stages.CHECKPOINT, path.parent.name)
                return {"checkpoint": json.loads(content or b"0"), **record}
        return None

    def checkpoint(self, stage: str) -> int:
        """How far the unfinished stage has counted, 0 where it has no checkpoint."""
        return int((self.progress(stage) or {"checkpoint": 0})["checkpoint"])


@dataclass
class Command:
    """A command in a process of its own."""

    process: "subprocess.Popen[bytes]"
    output_path: Path
    errors_path: Path

    def finish(self) -> int:
        return self.process.wait(timeout=240)

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    @property
    def code(self) -> int:
        assert self.process.returncode is not None
        return self.process.returncode

    @property
    def output(self) -> str:
        return self.output_path.read_text()

    @property
    def errors(self) -> str:
        return self.errors_path.read_text()


def until(condition: Callable[[], Any], patience: float = 180.0) -> None:
    """Wait for something that another process does."""
    limit = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < limit, "waited in vain"
        time.sleep(0.02)
