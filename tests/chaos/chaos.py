"""Kills, stops, full disks and flipped bits, at random moments of a recipe's run: `make chaos`.

python tests/chaos/chaos.py [--recipe FILE] [--events 200] [--seed 0] [--record FILE]
python tests/chaos/chaos.py --recipe tests/chaos/workers.yaml --events 40

A recipe is run once undisturbed; then again and again, disturbed, in a folder of its own, each run going on from what
the one before has left. Lost is: an artifact that was whole before an event and is not after it, unless the event hit
it; and a result of a run that came to its end and differs from the undisturbed one. Also counted are tracebacks and
unexpected errors, and processes that outlive their run (MLflow's sender aside). The seed decides kinds,
moments and places. Without `--recipe` the small stages of the test suite run, which count instead of learn and have no
workers; of a recipe's events every second one kills a worker process and lets the run go on.

What happened is told and kept as it goes, in `build/chaos/`. The same command goes on from there: an hour that was cut
short is not lost, and a larger `--events` only adds. Another recipe or a changed program begins a record of its own.
"""

import argparse
import contextlib
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
from tally import ENDED, Tally, Turn, Undisturbed

from iowbc.errors import Damaged
from iowbc.files import data_digest, folder_digest
from iowbc.pipeline.code import PACKAGE
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import load_recipe

SMALL_STAGES = Path(__file__).parents[1] / "pipeline" / "fake_stages.py"
SMALL_PROGRAM = f"""
from iowbc.__main__ import leave_while_reading
leave_while_reading()
import runpy
runpy.run_path({str(SMALL_STAGES)!r}, run_name="__main__")
"""
"""The command line on the small stages, which answers Ctrl-C as early as `iowbc` does."""
SMALL_RECIPE = "seed: 3\nexecution: {tracking_patience: 0, line_interval: 0.1}\n"
SMALL_BEHAVIOUR = {
    name: {"steps": 10, "pause": 0.02} for name in ("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export")
}
PATIENCE = 900.0
"""Seconds within which a run that was asked to stop, or met a full disk, has ended."""
LEAVING = 20.0
"""Seconds within which the processes of a run that was killed are gone."""
WORKING = 2.0
"""Seconds after its appearance within which a worker is killed."""
WORKERS = {"labelling worker": "multiprocessing.spawn", "training worker": "task.vector.worker"}
"""What worker processes do, and what their command lines have in them."""
RECORDS = Path("build", "chaos")
"""Where records stand that have no file of their own."""


@dataclass
class Chaos:
    """A recipe's runs in one folder, and what happened to them."""

    command: Sequence[str]
    recipe: Path
    folder: Path
    seed: int
    tally: Tally
    workers: bool
    """Whether stages have worker processes."""
    draws: random.Random = field(default_factory=random.Random)
    """Of the present turn."""
    pace: float = 0.0
    """About the time that a run takes now [s]: within it each turn's moment is drawn."""

    @property
    def store(self) -> Store:
        return Store(Runs(self.folder / "runs"))

    def start(self, *words: str) -> "subprocess.Popen[bytes]":
        """A command in the folder, with its output in files."""
        settings = {
            **os.environ,
            "FAKE_BEHAVIOUR": json.dumps(SMALL_BEHAVIOUR),
            "IOWBC_RUNS": "runs",
            "TMPDIR": str(self.folder),
        }
        for details in self.folder.glob("iowbc-*.txt"):
            details.unlink()
        with (self.folder / "output.txt").open("wb") as output, (self.folder / "errors.txt").open("wb") as errors:
            return subprocess.Popen(
                [*self.command, *words], cwd=self.folder, env=settings, stdout=output, stderr=errors
            )

    def run(self) -> "subprocess.Popen[bytes]":
        return self.start("run", str(self.recipe))

    @property
    def undisturbed(self) -> Undisturbed:
        assert self.tally.undisturbed is not None
        return self.tally.undisturbed

    def measure(self) -> None:
        """Run once to the end, and remember the results."""
        begun = time.monotonic()
        code = self.run().wait()
        seconds = time.monotonic() - begun
        if code:
            raise SystemExit(f"the undisturbed run ended with {code}:\n{self.said()}")
        self.tally.begin(Undisturbed(seconds, self.results()))
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
        """What the last command printed, and the details that it wrote elsewhere."""
        files = [*(self.folder / name for name in ("output.txt", "errors.txt")), *self.folder.glob("iowbc-*.txt")]
        return "".join(path.read_text(errors="replace") for path in files)

    def turn(self) -> None:
        """One run with one disturbance of a drawn kind at a drawn moment, then a look at what is left."""
        number = len(self.tally.turns)
        self.draws.seed(f"{self.seed}/{number}")
        disturb = self.draws.choice(DISTURBANCES)
        if self.workers and number % 2:
            disturb = kill_worker
        self.pace = self.pace or self.undisturbed.seconds
        moment = self.draws.random() * self.pace
        begun = time.monotonic()
        process, struck, lost = self.run(), Struck(ENDED), list[str]()
        try:
            process.wait(moment)
            self.pace = max(time.monotonic() - begun, self.pace / 2)  # the machine may have less to do by now
        except subprocess.TimeoutExpired:
            before = self.whole()
            struck = disturb(self, process)
            kept = self.whole()
            lost = [str(place.relative_to(self.folder)) for place in before if place not in {*kept, struck.artifact}]
        finally:
            process.kill()
            process.wait()
        tracebacks = self._unexpected()
        left = self._left()
        if struck.kind == ENDED or process.returncode == 0:
            lost += self._ended(process.returncode)
            self._forget()
        if code := self.start("status").wait():
            tracebacks.append(f"status ended with {code} after this:\n{self.said()}")
        else:
            tracebacks += self._unexpected()
        self.tally.add(Turn(number, struck.kind, round(moment, 2), tuple(lost), tuple(tracebacks), tuple(left)))

    def _unexpected(self) -> list[str]:
        said = self.said()
        return [said] if "Traceback" in said or "unexpected error" in said else []

    def _ended(self, code: int) -> list[str]:
        """What a run that came to its end before anything happened to it has made otherwise than the undisturbed."""
        found = self.results()
        other = [
            f"{stage}: {found.get(stage)} instead of {digest}"
            for stage, digest in self.undisturbed.results.items()
            if found.get(stage) != digest
        ]
        return [*other, f"the run ended with {code}:\n{self.said()}"] if code or other else []

    def _forget(self) -> None:
        """Begin again with an empty folder."""
        for _ in range(100):
            shutil.rmtree(self.folder / "runs", ignore_errors=True)  # a sender may still write to it
            if not (self.folder / "runs").exists():
                return
            time.sleep(0.1)

    def _left(self) -> list[str]:
        """Processes of this folder's runs that do not go when they should."""
        limit = time.monotonic() + LEAVING
        while (found := self.processes()) and time.monotonic() < limit:
            time.sleep(0.1)
        return list(found.values())

    def processes(self) -> dict[int, str]:
        """Command lines of the processes that runs in this folder have started, by number, without MLflow's sender."""
        found = {}
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.Error):  # of one that has just ended
                if process.environ().get("TMPDIR") == str(self.folder) and not _sends(process):
                    found[process.pid] = " ".join(process.cmdline())
        return found

    def flip(self, files: Sequence[Path]) -> Path | None:
        """Change one bit of one of the files; returns which."""
        filled = sorted(path for path in files if path.is_file() and path.stat().st_size)
        if not filled:
            return None
        path = self.draws.choice(filled)
        content = bytearray(path.read_bytes())
        content[self.draws.randrange(len(content))] ^= 1 << self.draws.randrange(8)
        path.write_bytes(content)
        return path


def _sends(process: psutil.Process) -> bool:
    try:
        return any("sender" in word for word in process.cmdline())
    except psutil.Error:
        return False


@dataclass(frozen=True)
class Struck:
    """What a disturbance was."""

    kind: str
    """In words; `ENDED` where the run came to its end before."""
    artifact: Path | None = None
    """Folder of the artifact that it damaged."""


def kill(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    process.kill()
    process.wait()
    return Struck("kill")


def kill_worker(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    """Kill a worker a moment after there is one. The run goes on, or ends with a sentence."""
    pause = chaos.draws.random() * WORKING
    while process.poll() is None:
        if _workers(process):
            time.sleep(pause)
            workers = _workers(process)
            if workers:
                kind, victim = chaos.draws.choice(workers)
                victim.kill()
                process.wait(PATIENCE)
                return Struck(f"kill of a {kind}")
        time.sleep(0.02)
    return Struck(ENDED)


def _workers(process: "subprocess.Popen[bytes]") -> list[tuple[str, psutil.Process]]:
    """Worker processes of a run, by what they do and in the order of their start."""
    found = []
    with contextlib.suppress(psutil.Error):
        for child in sorted(psutil.Process(process.pid).children(recursive=True), key=lambda child: child.pid):
            line = " ".join(child.cmdline())
            found += [(kind, child) for kind, mark in WORKERS.items() if mark in line]
    return found


def kill_sender(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    """Kill MLflow's sender where there is one, and stop the run a second later."""
    for child in psutil.Process(process.pid).children(recursive=True):
        if _sends(child):
            child.kill()
    time.sleep(1.0)
    stop(chaos, process)
    return Struck("kill of MLflow's sender, then a stop")


def stop(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    process.send_signal(chaos.draws.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP]))
    process.wait(PATIENCE)
    return Struck("stop")


def abort(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    for _ in range(2):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.05)
    process.wait(PATIENCE)
    return Struck("second stop, which aborts")


def fill_disk(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    """No file grows any more, as where 0 bytes are left."""
    try:
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, 0))
    except ProcessLookupError:
        return Struck(ENDED)
    process.wait(PATIENCE)
    return Struck("full disk")


def damage_artifact(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    kill(chaos, process)
    store = chaos.folder / "runs" / "store"
    hit = chaos.flip(list(store.rglob("*")))
    return Struck("bit of an artifact", None if hit is None else Path(*hit.parts[: len(store.parts) + 2]))


def damage_checkpoint(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    kill(chaos, process)
    chaos.flip(list((chaos.folder / "runs" / "work").rglob("*")))
    return Struck("bit of a checkpoint")


def damage_journal(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    kill(chaos, process)
    tracking = chaos.folder / "runs" / "tracking"
    chaos.flip([*tracking.glob("*.jsonl"), *tracking.glob("*.sent")])
    return Struck("bit of a journal")


def damage_record(chaos: Chaos, process: "subprocess.Popen[bytes]") -> Struck:
    kill(chaos, process)
    chaos.flip([*(chaos.folder / "runs" / "locks").glob("*"), *(chaos.folder / "runs" / "work").glob("*/*.json")])
    return Struck("bit of a record")


DISTURBANCES: tuple[Callable[[Chaos, "subprocess.Popen[bytes]"], Struck], ...] = (
    kill,
    kill_sender,
    stop,
    abort,
    fill_disk,
    damage_artifact,
    damage_checkpoint,
    damage_journal,
    damage_record,
)
"""What may happen to any run."""


def play(recipe: Path | None, events: int, seed: int, folder: Path, record: Path | None = None) -> Tally:
    """Disturb a recipe's runs until so many events are recorded, and run it once more to the end."""
    command, workers = [sys.executable, "-m", "iowbc"], recipe is not None
    if recipe is None:
        command = [sys.executable, "-c", SMALL_PROGRAM]
        recipe = folder / "small.yaml"
        recipe.write_text(SMALL_RECIPE)
    tally = Tally.of(record or RECORDS / _record_name(recipe, seed))
    if tally.turns:
        print(f"{tally.file} has {tally.line}", flush=True)
    if tally.events >= events:
        return tally
    chaos = Chaos(command, recipe.absolute(), folder, seed, tally, workers)
    if tally.undisturbed is None:
        chaos.measure()
    while tally.events < events:
        chaos.turn()
        last = tally.turns[-1]
        print(f"{last.moment:.1f} s, {last.kind}; {tally.line}", *last.findings, sep="\n", flush=True)
    lost = chaos._ended(chaos.run().wait())
    tally.add(Turn(len(tally.turns), ENDED, chaos.undisturbed.seconds, tuple(lost), tuple(chaos._unexpected())))
    return tally


def _record_name(recipe: Path, seed: int) -> str:
    """Of a record that belongs to this recipe, this program and this seed."""
    what = data_digest([load_recipe(recipe).recipe.model_dump(mode="json"), folder_digest(PACKAGE)])
    return f"{recipe.stem}-seed-{seed}-{what[:8]}.jsonl"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recipe", type=Path, help="recipe to run; the small stages of the test suite")
    parser.add_argument("--events", type=int, default=200, help="how many there are in the record in the end")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--record", type=Path, help="file to go on from and to add to; one in build/chaos")
    asked = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGHUP):  # under nohup, runs would inherit that they are ignored
        signal.signal(number, signal.default_int_handler)
    try:
        with tempfile.TemporaryDirectory(prefix="iowbc-chaos-", ignore_cleanup_errors=True) as folder:
            tally = play(asked.recipe, asked.events, asked.seed, Path(folder), asked.record)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on from what was told last", file=sys.stderr)
        return 130
    print(tally.table())
    print(f"seed {asked.seed}; each turn is in {tally.file}")
    return 0 if tally.clean else 1


if __name__ == "__main__":
    sys.exit(main())
