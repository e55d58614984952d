"""Kills of nodes at random moments of a run, or of a sweep, on a Ray cluster of this machine: `make chaos-nodes`.

python tests/chaos/nodes.py [--recipe recipes/smoke.yaml] [--kills 10] [--nodes 3] [--gap 20] [--seed 0] [--until STAGE]
python tests/chaos/nodes.py --actors 3 --until distill
python tests/chaos/nodes.py --vary seed=0..1 --until rg-fit --kills 10

The recipe is run once undisturbed, with local processes. Then it runs on nodes of one core each, which keep to their
own disks; after random pauses, `--gap` seconds long on average, a random node is killed with all its processes, and a
fresh one takes its place. A run that ends before all kills are made begins again in an empty store; one that gives up,
because a stage was lost too often, is begun again as its last line says. Lost is: an artifact that was finished before
a kill and is not there in the end, and a result that differs from the undisturbed one. Also counted are tracebacks, and
worker processes that outlive the run. The seed decides pauses and nodes. Each kill is told and kept in `build/chaos/`.
"""

import argparse
import contextlib
import os
import random
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
from tally import ENDED, Tally, Turn, Undisturbed

from iowbc.pipeline.cluster.connection import ALONE, STARTS
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

PATIENT = {"RAY_raylet_start_wait_time_s": "300"}
"""Environment in which a node may take its time to start on a busy machine."""
NODE = {
    "object_store_memory": 1 << 30,
    "include_dashboard": False,
    "include_log_monitor": False,
    "no_monitor": True,
}
"""Settings of each node."""
IDLE = ("IDLE", "Agent")
"""Ends of the names of Ray's processes that do nothing for a run."""
WORKERS = ("multiprocessing.spawn", "task.vector.worker", "ray::ActorHost")
"""What the command lines of stages' worker processes and rollout actors have in them."""
LEAVING = 20.0
"""Seconds within which they are gone after a run."""
POLL = 0.2
"""Seconds between two looks at a run."""
MOST_STARTS = 20
"""Times that the same command is given before the series counts as failed."""
RECORDS = Path("build", "chaos")


class Nodes:
    """A Ray cluster on 127.0.0.1: a head that runs nothing, and nodes of one core that can be killed."""

    def __init__(self, count: int) -> None:
        from ray.cluster_utils import Cluster

        self._cluster = Cluster()
        self._cluster.add_node(num_cpus=0, **NODE)
        self.nodes = [self._added() for _ in range(count)]

    @property
    def address(self) -> str:
        return str(self._cluster.address)

    def replace(self, draws: random.Random) -> str:
        """Kill a random node with all its processes, and start another; what it was running, in words."""
        place = draws.randrange(len(self.nodes))
        node = self.nodes[place]
        processes = [psutil.Process(entry.process.pid) for own in node.all_processes.values() for entry in own]
        processes += [child for process in processes for child in process.children(recursive=True)]
        names = []
        for process in processes:
            with contextlib.suppress(psutil.Error):  # it may have ended by itself
                names.append(process.name())
                process.kill()
        node.kill_all_processes(check_alive=False, allow_graceful=False)
        self._cluster.worker_nodes.discard(node)
        self.nodes[place] = self._added()
        work = sorted({name for name in names if name.startswith("ray::") and not name.endswith(IDLE)})
        return f"kill of a node that ran {', '.join(work)}" if work else "kill of a node that ran nothing"

    def close(self) -> None:
        for node in self.nodes:
            node.kill_all_processes(check_alive=False, allow_graceful=False)
        self._cluster.shutdown()

    def _added(self) -> Any:
        """A node; on a busy machine Ray's own processes give each other up, and it takes another attempt."""
        for _ in range(STARTS - 1):
            with contextlib.suppress(Exception):
                return self._cluster.add_node(num_cpus=1, **NODE)
        return self._cluster.add_node(num_cpus=1, **NODE)


@dataclass
class Series:
    """Runs of one command with kills, and what they came to."""

    words: Sequence[str]
    """Of the command line after `iowbc`."""
    folder: Path
    nodes: Nodes
    tally: Tally
    gap: float
    draws: random.Random
    finished: dict[tuple[str, str], str] = field(default_factory=dict)
    """Digests of the artifacts that were there before a kill of this run, by stage and key."""

    def undisturbed(self) -> None:
        """Run once with local processes, and remember the results."""
        begun = time.monotonic()
        if code := self._start("here").wait():
            raise SystemExit(f"the undisturbed run ended with {code}:\n{self._said()}")
        results = {f"{stage}/{key}": digest for (stage, key), digest in self._results("here").items()}
        self.tally.begin(Undisturbed(time.monotonic() - begun, results))

    def go_on(self, kills: int) -> None:
        """Kill nodes of runs until so many kills are made and the last run has come to its end."""
        for number in range(MOST_STARTS):
            begun = time.monotonic()
            process = self._start("spread", "--engine", "ray", "--address", self.nodes.address, "--workers", "1")
            while self._lasts(process, self.draws.uniform(0.0, 2.0 * self.gap) if self._kills < kills else None):
                self.finished |= self._results("spread")
                moment = time.monotonic() - begun
                self._tell(Turn(len(self.tally.turns), self.nodes.replace(self.draws), round(moment, 1)))
            over = process.returncode == 0
            if not over:
                print(self._said(), flush=True)
            self._tell(self._ending(process.returncode, time.monotonic() - begun))
            if over and self._kills >= kills:
                return
            if over:
                (self.folder / "spread").rename(self.folder / f"done-{number}")
                self.finished.clear()
        raise SystemExit(f"not done after {MOST_STARTS} runs:\n{self._said()}")

    @property
    def _kills(self) -> int:
        return sum(turn.kind.startswith("kill") for turn in self.tally.turns)

    def _start(self, runs: str, *further: str) -> "subprocess.Popen[bytes]":
        with (self.folder / "said.txt").open("wb") as said:
            command = [sys.executable, "-m", "iowbc", *self.words, *further, "--runs", str(self.folder / runs)]
            return subprocess.Popen(command, stdout=said, stderr=said)

    def _lasts(self, process: "subprocess.Popen[bytes]", seconds: float | None) -> bool:
        """Whether a run still goes on after so many seconds; without a limit, once it has ended."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        return process.poll() is None

    def _ending(self, code: int, seconds: float) -> Turn:
        """What a run has left that came to its end, or gave up."""
        found, lost = self._results("spread"), []
        assert self.tally.undisturbed is not None
        for (stage, key), digest in self.finished.items():
            if found.get((stage, key)) != digest:
                lost.append(f"{stage}/{key}: finished before a kill, and now {found.get((stage, key))}")
        if code == 0:
            ours = {f"{stage}/{key}": digest for (stage, key), digest in found.items()}
            theirs = self.tally.undisturbed.results
            names = [name for name in {**theirs, **ours} if ours.get(name) != theirs.get(name)]
            lost += [f"{name}: {ours.get(name)} instead of {theirs.get(name)}" for name in names]
        said = self._said()
        unexpected = "Traceback" in said or "unexpected error" in said
        kind = ENDED if code == 0 else f"none, the run gave up with {code}"
        return Turn(
            len(self.tally.turns), kind, round(seconds, 1), tuple(lost), (said,) if unexpected else (), tuple(left())
        )

    def _results(self, runs: str) -> dict[tuple[str, str], str]:
        artifacts = Store(Runs(self.folder / runs)).artifacts()
        return {(one.manifest.stage, one.manifest.key): one.manifest.digest for one in artifacts}

    def _said(self) -> str:
        return (self.folder / "said.txt").read_text(errors="replace")

    def _tell(self, turn: Turn) -> None:
        self.tally.add(turn)
        print(f"{turn.moment:.1f} s, {turn.kind}; {self.tally.line}", *turn.findings, sep="\n", flush=True)


def left() -> list[str]:
    """Command lines of stages' worker processes below this one that do not go when they should."""
    limit = time.monotonic() + LEAVING
    while (found := _workers()) and time.monotonic() < limit:
        time.sleep(POLL)
    return found


def _workers() -> list[str]:
    found = []
    for process in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):  # of one that has just ended
            line = " ".join(process.cmdline())
            found += [line] if any(mark in line for mark in WORKERS) else []
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recipe", type=Path, default=Path("recipes/smoke.yaml"))
    parser.add_argument("--vary", help="PATH=VALUES: a sweep over them instead of a run")
    parser.add_argument("--until", help="stage at which it ends")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--nodes", type=int, default=3)
    parser.add_argument("--actors", type=int, help="rollout actors of each training; without, it stays on one node")
    parser.add_argument("--gap", type=float, default=20.0, help="mean seconds between two kills")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    words = ["sweep" if asked.vary else "run", str(asked.recipe), "--set", "execution.copy_files=true"]
    words += ["--set", "execution.tracking_patience=0"]
    words += ["--set", f"execution.rollout_actors={asked.actors}"] if asked.actors else []
    words += ["--set", asked.vary] if asked.vary else []
    words += ["--until", asked.until] if asked.until else []
    record = RECORDS / f"nodes-{words[0]}-{asked.recipe.stem}-seed-{asked.seed}.jsonl"
    record.parent.mkdir(parents=True, exist_ok=True)
    record.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="iowbc-nodes-", ignore_cleanup_errors=True) as folder:
        token = secrets.token_hex(32)
        os.environ |= {
            **ALONE,
            **PATIENT,
            "RAY_AUTH_TOKEN": token,
            "RAY_TMPDIR": folder,
        }  # its own files lie in ray/ there
        nodes = Nodes(asked.nodes)
        try:
            series = Series(words, Path(folder), nodes, Tally(record), asked.gap, random.Random(asked.seed))
            series.undisturbed()
            series.go_on(asked.kills)
        finally:
            nodes.close()
    assert series.tally.undisturbed is not None
    print(f"undisturbed {series.tally.undisturbed.seconds:.0f} s, {len(series.tally.undisturbed.results)} results")
    print(series.tally.table())
    print(f"seed {asked.seed}; each turn is in {record}")
    return 0 if series.tally.clean else 1


if __name__ == "__main__":
    sys.exit(main())
