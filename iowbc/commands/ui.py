"""`iowbc ui`: MLflow's web interface on the runs of this folder, for this machine alone."""

import os
import signal
import socket
import subprocess
import sys

from rich.console import Console

from iowbc.commands.training import require_training
from iowbc.errors import UsageError
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import client, set_up
from iowbc.pipeline.tracking.tracker import backlog, start_sender
from iowbc.pipeline.writability import require_writable_runs

HOST = "127.0.0.1"
LAST_PORT = 65_535


def serve(runs: Runs, console: Console, port: int) -> int:
    """Serve until interrupted; returns the server's exit code. Raises `UsageError` where it cannot begin."""
    require_training("ui")
    require_writable_runs(runs)
    if not _free(port):
        other = next((other for other in range(port + 1, LAST_PORT + 1) if _free(other)), None)
        raise UsageError(f"port {port} is taken; try --port {other or 'with another number'}")
    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGINT))
    uri = f"sqlite:///{runs.database.absolute()}"
    with set_up(runs):
        client(uri).search_experiments(max_results=1)
    if backlog(runs):
        start_sender(runs)
    console.print(f"MLflow on http://{HOST}:{port} in about a quarter of a minute; Ctrl-C ends it", highlight=False)
    command = [sys.executable, "-m", "mlflow", "server", "--host", HOST, "--port", str(port), "--workers", "1"]
    command += ["--backend-store-uri", uri, "--default-artifact-root", runs.tracked_files.absolute().as_uri()]
    environment = {**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true", "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"}
    with subprocess.Popen(command, env=environment) as server:
        try:
            return server.wait()
        finally:
            server.terminate()


def _free(port: int) -> bool:
    """Whether a server may listen on a port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
    return True
