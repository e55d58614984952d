"""A Ray cluster of this machine alone: on 127.0.0.1, without dashboard, log monitor and autoscaler."""

import contextlib
import os
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from iowbc.errors import UsageError

ADDRESS = "127.0.0.1"
SETTINGS = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "PYTHONUNBUFFERED": "1"}
"""Environment in which Ray leaves 127.0.0.1 as it is (on Linux it puts a reachable address in its place by default)."""
STARTED = "Ray runtime started"
STARTS = 4
"""Attempts at a node: on a busy machine Ray's own processes give each other up after 15 s."""
PATIENCE = 120.0
"""Seconds that an attempt may take."""
LAST_WORDS = 500
"""Characters of Ray's output that are shown where it does not start."""
POLL = 0.1
"""Seconds between two looks at what a node says."""
STOP_PATIENCE = 15.0
"""Seconds that a node has to end all its processes."""
MAIN = (
    "import sys; from iowbc.processes import die_with_parent; die_with_parent(int(sys.argv.pop(1)), number=15); "
    "from ray.scripts.scripts import main; main()"
)
"""`ray start` as a process that ends, with all of its own, when its parent does."""


@contextlib.contextmanager
def node(cores: int) -> Iterator[str]:
    """A cluster of one node to the end of the block; its address. Raises `UsageError` where it does not start."""
    port = free_port()
    words = [sys.executable, "-c", MAIN, str(os.getpid()), "start", "--block", "--head", f"--port={port}"]
    words += [f"--node-ip-address={ADDRESS}", f"--num-cpus={cores}", "--disable-usage-stats"]
    words += ["--no-monitor", "--include-dashboard=false", "--include-log-monitor=false"]
    with tempfile.TemporaryDirectory(prefix="iowbc-ray-") as folder:
        for _ in range(STARTS):
            process, told = _begun(words, Path(folder, "ray.log"))
            if STARTED in told:
                break
            _stop(process)
        else:
            raise UsageError(f"Ray does not start here: {told.strip()[-LAST_WORDS:] or 'it says nothing'}")
        try:
            yield f"{ADDRESS}:{port}"
        finally:
            _stop(process)


def secured() -> dict[str, str]:
    """Environment in which Ray listens to those alone who know a token, one that nobody knows yet."""
    return {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}


def _begun(words: Sequence[str], log: Path) -> tuple["subprocess.Popen[bytes]", str]:
    """A node's process, and what it says by the time it has started, ended, or used up its time."""
    with log.open("wb") as output:
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=os.environ | SETTINGS,
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
    """End a node with all its processes."""
    process.terminate()
    try:
        process.wait(STOP_PATIENCE)
    except subprocess.TimeoutExpired:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def free_port() -> int:
    """A port that nobody listens on at this moment."""
    with socket.socket() as one:
        one.bind((ADDRESS, 0))
        return int(one.getsockname()[1])
