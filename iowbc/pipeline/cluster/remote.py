"""What runs on a node: one stage, told to the driver while it goes on."""

import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, Protocol

from iowbc.errors import Interrupted, IowbcError
from iowbc.files import previous
from iowbc.pipeline.cluster.folders import Files, Folder, files_of, placed, write_files
from iowbc.pipeline.cluster.identity import Identity, identity
from iowbc.pipeline.cluster.mailbox import Event
from iowbc.pipeline.cluster.spread import NodeSpread
from iowbc.pipeline.stage import Job
from iowbc.recipe.recipe import Recipe

WORD_INTERVAL = 0.5
"""Seconds between two words to the driver; each asks whether to stop, too."""
FILES_INTERVAL = 10.0
"""Seconds between two looks for new checkpoints, which go to the driver where the node does not see its folder."""
TOKEN = "driver"
"""File in a stage's scratch by which a node sees that it shares the driver's folder."""
SCRATCH, OUT = "scratch", "out"


@dataclass(frozen=True)
class Order:
    """One execution of a stage on a node."""

    task: str
    """Identifier at the mailbox."""
    identity: Identity
    """The driver's."""
    run: Callable[[Job], None]
    recipe: Recipe
    key: str
    robot: Folder
    inputs: Mapping[str, Folder]
    predecessor: Folder | None
    out: str
    """Where the driver has its output."""
    work: str
    """Where the driver has its scratch."""
    token: str
    workers: int
    copy: bool
    """Whether the node works on its own disk although it may see the driver's folders."""


@dataclass(frozen=True)
class StageOutcome:
    """How an execution has ended."""

    state: Literal["done", "stopped", "failed", "error", "mismatch"]
    text: str = ""
    out: Files | None = None
    """What the stage left; None where the driver sees it."""


def execute(order: Order, scratch: tuple[Any, ...], mailbox: Any) -> StageOutcome:
    """Run a stage. `scratch`: Ray's reference to what earlier attempts have left; `mailbox`: Ray's handle."""
    import ray

    own = identity()
    if different := order.identity.mismatch(own):
        return StageOutcome("mismatch", different)
    shared = not order.copy and _read(Path(order.work, TOKEN)) == order.token
    with tempfile.TemporaryDirectory(prefix="iowbc-stage-") as folder:
        out, work = (Path(order.out), Path(order.work)) if shared else (Path(folder, OUT), Path(folder, SCRATCH))
        out.mkdir(exist_ok=True)
        if not shared:
            work.mkdir()
            write_files(work, ray.get(scratch[0]))
        report = NodeReport(MailboxChannel(mailbox, order.task), work, sends=not shared)
        report.say(f"runs on {own.host}")
        report.flush()
        here = partial(placed, fetch=ray.get, copy=order.copy)
        try:
            robot, inputs = here(order.robot), {name: here(read) for name, read in order.inputs.items()}
            known = {robot: order.robot, **{inputs[name]: read for name, read in order.inputs.items()}}
            job = Job(
                recipe=order.recipe,
                key=order.key,
                robot=robot,
                inputs=inputs,
                out=out,
                work=work,
                workers=order.workers,
                report=report,
                interrupted=report.stopping,
                predecessor=None if order.predecessor is None else here(order.predecessor),
                spread=NodeSpread(order.identity, known, report.stopping, report.say, copy=order.copy),
            )
            order.run(job)
        except Interrupted as stopped:
            report.end(files=True)
            return StageOutcome("stopped", str(stopped))
        except IowbcError as failed:
            report.end(files=True)
            return StageOutcome("failed", str(failed))
        except Exception:
            report.end(files=True)
            return StageOutcome("error", traceback.format_exc())
        report.end()
        return StageOutcome("done", "", None if shared else files_of(out))


class Channel(Protocol):
    """The way to the mailbox."""

    def tell(self, events: list[Event]) -> bool:
        """Tell what happened; whether the stage is to stop, as far as was heard."""

    def wait(self) -> None:
        """Return once all has arrived that was told."""


class MailboxChannel:
    """Tells without waiting: a task that waits for Ray gives its cores away to another one meanwhile."""

    def __init__(self, mailbox: Any, task: str) -> None:
        self._mailbox, self._task = mailbox, task
        self._answer: Any = None
        self._stop = False

    def tell(self, events: list[Event]) -> bool:
        """Tell what happened; whether the stage is to stop, as far as was heard."""
        import ray

        if self._answer is not None and ray.wait([self._answer], timeout=0)[0]:
            self._stop = bool(ray.get(self._answer))
        self._answer = self._mailbox.tell.remote(self._task, events)
        return self._stop

    def wait(self) -> None:
        """Return once all has arrived that was told; it arrives in order."""
        import ray

        if self._answer is not None:
            ray.get(self._answer)


class NodeReport:
    """A stage's report on a node: gathered, and told to the driver a few times a second."""

    def __init__(self, channel: Channel, work: Path, *, sends: bool) -> None:
        """work: the stage's scratch. sends: whether the driver does not see it, and is sent its files."""
        self._channel = channel
        self._work = work
        self._sends = sends
        self._events: list[Event] = []
        self._sent: dict[str, tuple[int, int]] = {}
        self._told = self._looked = time.monotonic()
        self._stop = False

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Record named values at a step."""
        self._add("metrics", dict(values), step)

    def progress(self, done: float, total: float, note: str = "") -> None:
        """Say how far the stage is; of several words that were not told yet the last one counts."""
        if self._events and self._events[-1][0] == "progress":
            self._events.pop()
        self._add("progress", done, total, note)

    def say(self, text: str) -> None:
        """Print one line."""
        self._add("say", text)

    def files(self, path: Path) -> None:
        """Let tracking have a file or folder of the scratch; the driver has it before it hears of it."""
        self._gather()
        self._add("shown", path.relative_to(self._work).as_posix())

    def stopping(self) -> bool:
        """Whether the driver wants the stage to stop after a checkpoint."""
        self._turn()
        return self._stop

    def flush(self, *, files: bool = False) -> None:
        """Tell all that was gathered, and, where asked for, what is new in scratch."""
        if files:
            self._gather()
        self._told = time.monotonic()
        events, self._events = self._events, []
        self._stop = self._channel.tell(events)

    def end(self, *, files: bool = False) -> None:
        """Tell the rest, and return once it has arrived."""
        self.flush(files=files)
        self._channel.wait()

    def _add(self, *event: Any) -> None:
        self._events.append(event)
        self._turn()

    def _turn(self) -> None:
        now = time.monotonic()
        if now - self._told > WORD_INTERVAL:
            look = now - self._looked > FILES_INTERVAL
            if look:
                self._looked = now
            self.flush(files=look)

    def _gather(self) -> None:
        """Gather the files of scratch that the driver neither sees nor has; of checkpoints the last one is enough."""
        if not self._sends:
            return
        files = [path for path in self._work.rglob("*") if path.is_file() and not path.name.startswith(".")]
        older = {previous(path) for path in files}
        found = {}
        for path in files:
            name, state = path.relative_to(self._work).as_posix(), path.stat()
            if path not in older and self._sent.get(name) != (state.st_mtime_ns, state.st_size):
                self._sent[name] = state.st_mtime_ns, state.st_size
                found[name] = path.read_bytes()
        if found:
            self._events.append(("files", found))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""
