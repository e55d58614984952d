"""Kills, stops, full disks and flipped bits, at random moments of a recipe's run: `make chaos`.

python tests/chaos/chaos.py [--recipe FILE] [--events 200] [--seed 0] [--record FILE]

A recipe is run once undisturbed; then again and again, disturbed, in a folder of its own, each run going on from what
the one before has left. Lost is: an artifact that was whole before an event and is not after it, unless the event hit
it; and a result of a run that came to its end and differs from the undisturbed one. Also counted are tracebacks and
errors that nobody foresaw, and processes that outlive their run (MLflow's sender aside). The seed decides kinds,
moments and places. Without `--recipe` the small stages of the test suite run, which count instead of learn.

What happened is told and kept as it goes, in `build/chaos/`. The same command goes on from there: an hour that was cut
short is not lost, and a larger `--events` only adds. Another recipe or a changed program begins a record of its own.
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
from tally import ENDED, Tally, Turn

from iowbc.errors import Damaged
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.digests import PACKAGE, data_digest, folder_digest
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
    draws: random.Random = field(default_factory=random.Random)
    """Of the present turn."""
    wanted: dict[str, str] = field(default_factory=dict)
    """Digest of each stage's results in the undisturbed run."""
    seconds: float = 0.0
    """Time that the undisturbed run took [s]."""

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
        """What the last command printed, and the details that it wrote elsewhere."""
        files = [*(self.folder / name for name in ("output.txt", "errors.txt")), *self.folder.glob("iowbc-*.txt")]
        return "".join(path.read_text(errors="replace") for path in files)

    def turn(self) -> None:
        """One run with one disturbance of a drawn kind at a drawn moment, then a look at what is left."""
        number = len(self.tally.turns)
        self.draws.seed(f"{self.seed}/{number}")
        kind, moment = self.draws.choice(sorted(KINDS)), self.draws.random() * self.seconds
        process, tracebacks = self.run(), []
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            before, family = self.whole(), psutil.Process(process.pid).children(recursive=True)
            hit = KINDS[kind](self, process)
            tracebacks += self._unforeseen()
            kept = self.whole()
            lost = [str(folder.relative_to(self.folder)) for folder in before if folder not in kept and folder != hit]
            left = self._left(family)
        else:
            kind, left = ENDED, []
            lost = self._ended(process.returncode)
            tracebacks += self._unforeseen()
            self._forget()
        finally:
            process.kill()
        if code := self.start("status").wait():
            tracebacks.append(f"status ended with {code} after this:\n{self.said()}")
        else:
            tracebacks += self._unforeseen()
        self.tally.add(Turn(number, kind, round(moment, 2), tuple(lost), tuple(tracebacks), tuple(left)))

    def _unforeseen(self) -> list[str]:
        said = self.said()
        return [said] if "Traceback" in said or "nobody foresaw" in said else []

    def _ended(self, code: int) -> list[str]:
        """What a run that came to its end before anything happened to it has made otherwise than the undisturbed."""
        found = self.results()
        other = [
            f"{stage}: {found.get(stage)} instead of {digest}"
            for stage, digest in self.wanted.items()
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

    def _left(self, family: Sequence[psutil.Process]) -> list[str]:
        """Processes of a run that are still there, without MLflow's sender, which has a session of its own."""
        own = [process for process in family if process.is_running() and not _sends(process)]
        _, alive = psutil.wait_procs(own, timeout=LEAVING)
        return [" ".join(process.cmdline()) for process in alive]

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


def kill(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.wait()


def kill_child(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    """Kill a worker where there is one; the run then goes on or fails with a sentence. It is stopped either way."""
    children = psutil.Process(process.pid).children(recursive=True)
    if children:
        chaos.draws.choice(sorted(children, key=lambda child: child.pid)).kill()
        time.sleep(1.0)
    stop(chaos, process)


def stop(chaos: Chaos, process: "subprocess.Popen[bytes]") -> None:
    process.send_signal(chaos.draws.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP]))
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


def play(recipe: Path | None, events: int, seed: int, folder: Path, record: Path | None = None) -> Tally:
    """Disturb a recipe's runs until so many events are recorded, and run it once more to the end."""
    command = [sys.executable, "-m", "iowbc"]
    if recipe is None:
        command = [sys.executable, "-c", SMALL_PROGRAM]
        recipe = folder / "small.yaml"
        recipe.write_text(SMALL_RECIPE)
    tally = Tally.of(record or RECORDS / _record_name(recipe, seed))
    if tally.turns:
        print(f"{tally.file} has {tally.line}", flush=True)
    if tally.events >= events:
        return tally
    chaos = Chaos(command, recipe.absolute(), folder, seed, tally)
    chaos.undisturbed()
    while tally.events < events:
        chaos.turn()
        last = tally.turns[-1]
        print(f"{last.moment:.1f} s, {last.kind}; {tally.line}", *last.findings, sep="\n", flush=True)
    lost = chaos._ended(chaos.run().wait())
    tally.add(Turn(len(tally.turns), ENDED, chaos.seconds, tuple(lost), tuple(chaos._unforeseen())))
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
