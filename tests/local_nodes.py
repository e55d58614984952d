"""A Ray cluster of several nodes on this machine, which can be killed one by one.

A process of its own holds the nodes (`python FILE`, with the parent's number and the cores of each node).
"""

import contextlib
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from iowbc.pipeline.cluster.connection import ALONE, STARTS, connected
from iowbc.processes import die_with_parent

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster
    from iowbc.pipeline.cluster.spread import NodeSpread

NODE = {
    "object_store_memory": 1 << 30,  # bytes on each node; what is more goes to disk
    "include_dashboard": False,
    "include_log_monitor": False,
    "no_monitor": True,
}
"""Settings of each node."""
STARTED = "all nodes run, address "
PATIENCE = 120.0
"""Seconds that an attempt may take."""
LAST_OUTPUT = 500
"""Characters of Ray's output that are shown where it does not start."""
POLL = 0.1
"""Seconds between two looks at the output."""
STOP_PATIENCE = 15.0
"""Seconds that the nodes have to end all their processes."""


@contextlib.contextmanager
def local_nodes(cores: Sequence[int]) -> Iterator[str]:
    """Nodes with these cores to the end of the block; the address of their cluster.

    Only who knows the token in this process's environment reaches it. Raises RuntimeError where they do not start.
    """
    os.environ.update(ALONE)
    os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))  # Ray reads a token once in a process
    with tempfile.TemporaryDirectory(prefix="iowbc-ray-", ignore_cleanup_errors=True) as folder:
        for _ in range(STARTS):
            process, output = _started(cores, folder)
            if STARTED in output:
                break
            _stop(process)
        else:
            raise RuntimeError(f"Ray does not start here: {output.strip()[-LAST_OUTPUT:] or 'it says nothing'}")
        try:
            yield output.partition(STARTED)[2].split()[0]
        finally:
            _stop(process)


@contextlib.contextmanager
def connected_nodes(cores: Sequence[int]) -> "Iterator[Cluster]":
    """A connection to such a cluster, whose nodes keep to their own disks."""
    with local_nodes(cores) as address, connected(address, copy=True) as cluster:
        yield cluster


def spread_over(cluster: "Cluster", paths: Iterable[Path]) -> "NodeSpread":
    """The nodes for calls that read these folders of this machine."""
    from iowbc.pipeline.cluster.spread import NodeSpread

    return NodeSpread({path: cluster.folder(path) for path in paths}, lambda: False, lambda text: None)


def _started(cores: Sequence[int], folder: str) -> tuple["subprocess.Popen[bytes]", str]:
    """The process that holds the nodes, and its output by the time they run, it ends, or its time is over."""
    words = [sys.executable, __file__, str(os.getpid()), *map(str, cores)]
    log = Path(folder, "nodes.log")
    with log.open("wb") as file:
        environment = os.environ | {"RAY_TMPDIR": folder}
        process = subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=file, stderr=file, env=environment, start_new_session=True
        )
    limit = time.monotonic() + PATIENCE
    while True:
        ended = process.poll() is not None or time.monotonic() > limit
        output = log.read_text(encoding="utf-8", errors="replace")
        if ended or STARTED in output:
            return process, output
        time.sleep(POLL)


def _stop(process: "subprocess.Popen[bytes]") -> None:
    """End the nodes with all their processes."""
    process.terminate()
    try:
        process.wait(STOP_PATIENCE)
    except subprocess.TimeoutExpired:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def main() -> None:
    """Start the nodes, print their address, and hold them until SIGTERM, or until the parent ends."""
    parent, *cores = sys.argv[1:]
    die_with_parent(int(parent), number=signal.SIGTERM)

    from ray.cluster_utils import Cluster

    nodes = Cluster()
    for count in cores:
        nodes.add_node(num_cpus=int(count), **NODE)
    print(f"{STARTED}{nodes.address}", flush=True)
    while True:
        signal.pause()


if __name__ == "__main__":
    main()
