"""Kills, stops, full disks and flipped bits, at random moments of a recipe's run: `make chaos`.

python tests/chaos/chaos.py [--recipe FILE] [--events 200] [--seed 0]

A recipe is run once undisturbed; then again and again, disturbed, in a folder of its own, each run going on from what
the one before has left. Lost is: an artifact that was whole before an event and is not after it, unless the event hit
it; and a result of a run that came to its end and differs from the undisturbed one. Also counted are tracebacks, and
processes that outlive their run (MLflow's sender aside). The seed decides kinds, moments and places. Without `--recipe`
the small stages of the test suite run, which count instead of learn.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from iowbc.errors import Damaged
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

SMALL_STAGES = Path(__file__).parents[1] / "pipeline" / "fake_stages.py"
SMALL_RECIPE = "seed: 3\nexecution: {tracking_patience: 0, line_interval: 0.1}\n"
SMALL_BEHAVIOUR = {
    name: {"steps": 10, "pause": 0.02} for name in ("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export")
}
PATIENCE = 900.0
"""Seconds within which a run that was asked to stop, or met a full disk, has ended."""
LEAVING = 20.0
"""Seconds within which the processes of a run that was killed are gone."""


@dataclass
class Count:
    """What came of the events of one kind."""

    events: int = 0
    lost: int = 0
    tracebacks: int = 0
    left: int = 0


@dataclass
class Chaos:
    """A recipe's runs in one folder, and what happened to them."""

    command: Sequence[str]
    recipe: Path
    folder: Path
    random: random.Random
    counts: dict[str, Count] = field(default_factory=dict)
    wanted: dict[str, str] = field(default_factory=dict)
    """Digest of each stage's results in the undisturbed run."""
    seconds: float = 0.0
    """Time that the undisturbed run took [s]."""
    finished: int = 0
    """Disturbed runs that came to their end."""

    @property
    def store(self) -> Store:
        return Store(Runs(self.folder / "runs"))

    def start(self, *words: str) -> "subprocess.Popen[bytes]":
        """A command in the folder, with its output in files."""
        settings = {**os.environ, "FAKE_BEHAVIOUR": json.dumps(SMALL_BEHAVIOUR), "IOWBC_RUNS": "runs"}
        with (self.folder / "output.txt").open("wb") as output, (self.folder / "errors.txt").open("wb") as errors:
            return subprocess.Popen(
                [*self.command, *words], cwd=self.folder, env=settings, stdout=output, stderr=errors
            )

    def run(self) -> "subprocess.Popen[bytes]":
        return self.start("run", str(self.recipe))

    def undisturbed(self) -> None:
        """Run once to the end, and remember the results."""
        begun = time.monotonic()
        code = self.run().wait()
        self.seconds = time.monotonic() - begun
        if code:
            raise SystemExit(f"the undisturbed run ended with {code}:\n{self.said()}")
        self.wanted = self.results()
        self._forget()

    def results(self) -> dict[str, str]:
        return {artifact.manifest.stage: artifact.manifest.digest for artifact in self.whole().values()}

    def whole(self) -> dict[Path, Artifact]:
        """Artifacts that are what was written."""
        found = {}
        for artifact in self.store.artifacts():
            try:
                artifact.verify()
            except Damaged:
                continue
            found[artifact.folder] = artifact
        return found

    def said(self) -> str:
        return "".join((self.folder / name).read_text(errors="replace") for name in ("output.txt", "errors.txt"))

    def event(self) -> None:
        """One disturbance of a drawn kind at a drawn moment, then a look at what is left."""
        kind = self.random.choice(sorted(KINDS))
        moment = self.random.random()
        process, count = self.run(), self.counts.setdefault(kind, Count())
        family: list[psutil.Process] = []
        try:
            process.wait(moment * self.seconds)
        except subprocess.TimeoutExpired:
            before = self.whole()
            family = psutil.Process(process.pid).children(recursive=True)
            hit = KINDS[kind](self, process)
            count.events += 1
            print(f"{moment * self.seconds:.1f} s: {kind}", file=sys.stderr, flush=True)
            kept = self.whole()
            count.lost += sum(folder not in kept and folder != hit for folder in before)
        else:
            self._ended(process.returncode, count)
        if "Traceback" in self.said():
            count.tracebacks += 1
            print(f"a traceback after '{kind}':\n{self.said()}", file=sys.stderr, flush=True)
        count.left += self._left(family)
        if self.start("status").wait() or "Traceback" in self.said():
            count.tracebacks += 1
            print(f"status after '{kind}':\n{self.said()}", file=sys.stderr, flush=True)

    def _ended(self, code: int, count: Count) -> None:
        """A run came to its end before anything happened to it: compare what it made, and begin again."""
        self.finished += 1
        found = self.results()
        if code or found != self.wanted:
            count.lost += max(1, sum(found.get(stage) != digest for stage, digest in self.wanted.items()))
            print(f"a run ended with {code}, results {found} instead of {self.wanted}:\n{self.said()}", file=sys.stderr)
        self._forget()

    def _forget(self) -> None:
        """Begin again with an empty folder."""
        for _ in range(100):
            shutil.rmtree(self.folder / "runs", ignore_errors=True)  # a sender may still write to it
            if not (self.folder / "runs").exists():
                return
            time.sleep(0.1)

    def _left(self, family: Sequence[psutil.Process]) -> int:
        """Processes of a run that are still there, without MLflow's sender, which has a session of its own."""
        own = [process for process in family if process.is_running() and not _sends(process)]
        _, alive = psutil.wait_procs(own, timeout=LEAVING)
        return len(alive)

    def flip(self, files: Sequence[Path]) -> Path | None:
        """Change one bit of one of the files; returns which."""
        filled = sorted(path for path in files if path.is_file() and path.stat().st_size)
        if not filled:
            return None
        path = self.random.choice(filled)
        content = bytearray(path.read_bytes())
        content[self.random.randrange(len(content))] ^= 1 << self.random.randrange(8)
        path.write_bytes(content)
        return path


def _sends(process: psutil.Process) -> bool:
    try:
        return any("sender" in word for word in process.cmdline())
    except psutil.Error:
        return False


def kill(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.wait()


def kill_child(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    """Kill a worker where there is one; the run then goes on or fails with a sentence. It is stopped either way."""
    children = psutil.Process(process.pid).children(recursive=True)
    if children:
        chaos.random.choice(sorted(children, key=lambda child: child.pid)).kill()
        time.sleep(1.0)
    stop(chaos, process)


def stop(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    process.send_signal(chaos.random.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP]))
    process.wait(PATIENCE)


def abort(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    for _ in range(2):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.05)
    process.wait(PATIENCE)


def fill_disk(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    """No file grows any more, as where 0 bytes are left."""
    try:
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, 0))
    except ProcessLookupError:
        return
    process.wait(PATIENCE)


def damage_artifact(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Path | None:
    kill(chaos, process)
    hit = chaos.flip(list((chaos.folder / "runs" / "store").rglob("*")))
    return None if hit is None else Path(*hit.parts[: len((chaos.folder / "runs" / "store").parts) + 2])


def damage_checkpoint(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    kill(chaos, process)
    chaos.flip(list((chaos.folder / "runs" / "work").rglob("*")))


def damage_journal(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    kill(chaos, process)
    tracking = chaos.folder / "runs" / "tracking"
    chaos.flip([*tracking.glob("*.jsonl"), *tracking.glob("*.sent")])


def damage_record(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    kill(chaos, process)
    chaos.flip([*(chaos.folder / "runs" / "locks").glob("*"), *(chaos.folder / "runs" / "work").glob("*/*.json")])


KINDS: dict[str, Callable[[Chaos, "subprocess.Popen[bytes]"], Path | None]] = {
    "kill": kill,
    "kill of a worker": kill_child,
    "stop": stop,
    "second stop, which aborts": abort,
    "full disk": fill_disk,
    "bit of an artifact": damage_artifact,
    "bit of a checkpoint": damage_checkpoint,
    "bit of a journal": damage_journal,
    "bit of a record": damage_record,
}
"""Each returns the artifact that it damaged, if any."""


def play(recipe: Path | None, events: int, seed: int, folder: Path) -> Chaos:
    """Disturb a recipe's runs so many times."""
    command = [sys.executable, "-m", "iowbc"]
    if recipe is None:
        command = [sys.executable, str(SMALL_STAGES)]
        recipe = folder / "small.yaml"
        recipe.write_text(SMALL_RECIPE)
    chaos = Chaos(command, recipe.absolute(), folder, random.Random(seed))
    chaos.undisturbed()
    while sum(count.events for count in chaos.counts.values()) < events:
        chaos.event()
    last = chaos.counts.setdefault("the last run, undisturbed", Count())
    chaos._ended(chaos.run().wait(), last)
    return chaos


def table(chaos: Chaos) -> str:
    """The counts in Markdown."""
    rows = ["| kind | count | lost | tracebacks | processes left |", "|---|---|---|---|---|"]
    for kind, count in sorted(chaos.counts.items()):
        rows.append(f"| {kind} | {count.events} | {count.lost} | {count.tracebacks} | {count.left} |")
    total = [sum(getattr(c, name) for c in chaos.counts.values()) for name in ("events", "lost", "tracebacks", "left")]
    rows.append(f"| all | {' | '.join(map(str, total))} |")
    return "\n".join(rows)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recipe", type=Path, help="recipe to run; the small stages of the test suite")
    parser.add_argument("--events", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="iowbc-chaos-", ignore_cleanup_errors=True) as folder:
        chaos = play(asked.recipe, asked.events, asked.seed, Path(folder))
    print(table(chaos))
    lost = sum(count.lost for count in chaos.counts.values())
    clean = not any(count.tracebacks or count.left for count in chaos.counts.values())
    print(f"seed {asked.seed}, {chaos.finished} runs came to their end; lost {lost}")
    return 0 if lost == 0 and clean else 1


if __name__ == "__main__":
    sys.exit(main())
