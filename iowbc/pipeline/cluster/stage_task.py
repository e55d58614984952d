"""A stage as a task on a node: its execution there, and its reports to the driver while it runs."""

import os
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from socket import gethostname
from typing import Any

import ray

from iowbc.files import previous
from iowbc.pipeline.cluster.folders import Files, SharedFolder, files_of, placed, write_files
from iowbc.pipeline.cluster.spread import NodeSpread
from iowbc.pipeline.stage import Job

Event = tuple[Any, ...]
"""`("metrics", values, step)`, `("progress", done, total, note)`, `("say", text)`, `("files", files)` of
scratch."""
REPORT_INTERVAL = 0.5
"""Seconds between two reports to the driver; the answer says whether to stop."""
FILES_INTERVAL = 10.0
"""Seconds between two searches for new checkpoints, which are sent to a driver whose folder the node does not see."""


class Mailbox:
    """Ray actor on the head node: events reported by tasks, and stop requests for them."""

    def __init__(self) -> None:
        self._events: dict[str, list[Event]] = {}
        self._stopping: set[str] = set()

    def report(self, task: str, events: list[Event]) -> bool:
        """Keep a task's events; True where the task is to stop after a checkpoint."""
        self._events.setdefault(task, []).extend(events)
        return task in self._stopping

    def collect(self, task: str) -> list[Event]:
        """A task's events since the last call."""
        return self._events.pop(task, [])

    def stop(self, task: str) -> None:
        """Let a task stop after a checkpoint."""
        self._stopping.add(task)


def execute(
    run: Callable[[Job], None],
    make: Callable[..., Job],
    *,
    robot: SharedFolder,
    inputs: Mapping[str, SharedFolder],
    predecessor: SharedFolder | None,
    out: Path,
    work: Path,
    scratch: tuple[Any, ...],
    task: str,
    mailbox: Any,
) -> Files:
    """Run a stage; returns its output, which is empty where the driver sees it. Raises what the stage raises.

    make: gives the job with all that does not depend on the node. out, work: folders on the driver. scratch: Ray's
    reference to the files that earlier attempts left. task: identifier at the mailbox. mailbox: Ray's handle.
    """
    shared = not robot.copy and os.path.exists(marker(work, task))
    with tempfile.TemporaryDirectory(prefix="iowbc-stage-") as folder:
        if not shared:
            out, work = Path(folder, "out"), Path(folder, "scratch")
            work.mkdir()
            write_files(work, ray.get(scratch[0]))
        out.mkdir(exist_ok=True)
        report = NodeReport(mailbox, task, work, sends=not shared)
        report.say(f"runs on {gethostname()}")
        report.flush()
        try:
            here, read = placed(robot), {name: placed(each) for name, each in inputs.items()}
            folders = {here: robot} | {read[name]: each for name, each in inputs.items()}
            job = make(
                robot=here,
                inputs=read,
                predecessor=None if predecessor is None else placed(predecessor),
                out=out,
                work=work,
                report=report,
                interrupted=report.stopping,
                spread=NodeSpread(folders, report.stopping, report.say),
            )
            run(job)
        except BaseException:
            report.gather()
            raise
        finally:
            report.end()
        return {} if shared else files_of(out)


def marker(work: Path, task: str) -> Path:
    """File in a stage's scratch by which a node sees that it shares the driver's folder."""
    return work / f".{task}"


class NodeReport:
    """A stage's report on a node: gathered, and sent to the driver a few times a second.

    It never waits for an answer: a task that waits for Ray gives its cores to another one meanwhile.
    """

    def __init__(self, mailbox: Any, task: str, work: Path, *, sends: bool) -> None:
        """work: the stage's scratch. sends: the driver does not see it, and is sent its files."""
        self._mailbox, self._task, self._work, self._sends = mailbox, task, work, sends
        self._events: list[Event] = []
        self._known: dict[str, tuple[int, int]] = {}
        """Time and size of the files that the driver has."""
        self._reported = self._looked = time.monotonic()
        self._answer: Any = None
        self._stop = False

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        self._add("metrics", dict(values), step)

    def progress(self, done: float, total: float, note: str = "") -> None:
        """Report progress; of several reports that were not sent yet the last one counts."""
        if self._events and self._events[-1][0] == "progress":
            self._events.pop()
        self._add("progress", done, total, note)

    def say(self, text: str) -> None:
        self._add("say", text)

    def stopping(self) -> bool:
        """True once the driver wants the stage to stop after a checkpoint."""
        self._flush_when_due()
        return self._stop

    def flush(self) -> None:
        """Send all buffered events."""
        self._reported = time.monotonic()
        if self._answer is not None and ray.wait([self._answer], timeout=0)[0]:
            self._stop = bool(ray.get(self._answer))
        events, self._events = self._events, []
        self._answer = self._mailbox.report.remote(self._task, events)

    def end(self) -> None:
        """Send the rest and wait until all has arrived; events arrive in order."""
        self.flush()
        ray.get(self._answer)

    def _add(self, *event: Any) -> None:
        self._events.append(event)
        self._flush_when_due()

    def _flush_when_due(self) -> None:
        now = time.monotonic()
        if now - self._reported > REPORT_INTERVAL:
            if now - self._looked > FILES_INTERVAL:
                self._looked = now
                self.gather()
            self.flush()

    def gather(self) -> None:
        """Gather the files of scratch that the driver neither sees nor has; of checkpoints the last one is enough."""
        if not self._sends:
            return
        files = [path for path in self._work.rglob("*") if path.is_file() and not path.name.startswith(".")]
        older = {previous(path) for path in files}
        found = {}
        for path in files:
            name, state = path.relative_to(self._work).as_posix(), path.stat()
            if path not in older and self._known.get(name) != (state.st_mtime_ns, state.st_size):
                self._known[name] = state.st_mtime_ns, state.st_size
                found[name] = path.read_bytes()
        if found:
            self._events.append(("files", found))
