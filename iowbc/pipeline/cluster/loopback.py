"""A Ray cluster of this machine alone: on 127.0.0.1, without dashboard, log monitor and autoscaler."""

import contextlib
import os
import re
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from iowbc.errors import UsageError
from iowbc.pipeline.cluster import loopback_nodes
from iowbc.pipeline.cluster.loopback_nodes import STARTED
from iowbc.processes import available_cores

LOCAL = re.compile(r"local(?::([1-9][0-9]?))?")
"""Addresses that stand for such a cluster, of one node or of as many as are named."""
ALONE = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}
"""Environment in which Ray listens on 127.0.0.1; on Linux it otherwise takes an address that others reach."""
STARTS = 4
"""Attempts: on a busy machine Ray's own processes give each other up after 15 to 30 s."""
PATIENCE = 120.0
"""Seconds that an attempt may take."""
LAST_WORDS = 500
"""Characters of Ray's output that are shown where it does not start."""
POLL = 0.1
"""Seconds between two looks at what the nodes say."""
STOP_PATIENCE = 15.0
"""Seconds that the nodes have to end all their processes."""


def shares(address: str) -> list[int]:
    """Cores of each node that `local` or `local:NODES` stands for; empty for the address of another cluster."""
    found = LOCAL.fullmatch(address)
    if found is None:
        return []
    count = int(found[1] or 1)
    return [max(1, available_cores() // count)] * count


@contextlib.contextmanager
def nodes(cores: Sequence[int]) -> Iterator[str]:
    """Nodes with these cores to the end of the block; the address of their cluster.

    They end with this process, however it ends. Raises `UsageError` where they do not start.
    """
    with tempfile.TemporaryDirectory(prefix="iowbc-ray-", ignore_cleanup_errors=True) as folder:
        for _ in range(STARTS):
            process, told = _begun(cores, folder)
            if STARTED in told:
                break
            _stop(process)
        else:
            raise UsageError(f"Ray does not start here: {told.strip()[-LAST_WORDS:] or 'it says nothing'}")
        try:
            yield told.partition(STARTED)[2].split()[0]
        finally:
            _stop(process)


def secured() -> dict[str, str]:
    """Environment in which Ray listens to those alone who know a token, one that nobody knows yet."""
    return {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}


def _begun(cores: Sequence[int], folder: str) -> tuple["subprocess.Popen[bytes]", str]:
    """The process that holds the nodes, and what it says by the time they run, it ends, or its time is over."""
    words = [sys.executable, "-m", loopback_nodes.__name__, str(os.getpid()), *map(str, cores)]
    log = Path(folder, "nodes.log")
    with log.open("wb") as output:
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=os.environ | ALONE | {"RAY_TMPDIR": folder},
            start_new_session=True,  # Ctrl-C reaches the run alone, which ends this
        )
    limit = time.monotonic() + PATIENCE
    while True:
        ended = process.poll() is not None or time.monotonic() > limit
        told = log.read_text(encoding="utf-8", errors="replace")
        if ended or STARTED in told:
            return process, told
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
