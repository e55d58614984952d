"""MLflow's interface answers on this machine alone and ends with the command."""

import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_taken_port_is_refused_with_a_free_one(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = int(other.getsockname()[1])
        words = [sys.executable, "-m", "iowbc", "ui", "--port", str(port), "--runs", str(tmp_path / "runs")]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f"port {port} is taken; try --port ")


@pytest.mark.slow
def test_the_interface_answers_and_ends(tmp_path: Path) -> None:
    port = free_port()
    address = f"http://127.0.0.1:{port}"
    words = [sys.executable, "-m", "iowbc", "ui", "--port", str(port), "--runs", str(tmp_path / "runs")]
    with (tmp_path / "log.txt").open("w") as log, subprocess.Popen(words, stdout=log, stderr=log) as server:
        limit = time.monotonic() + 90.0
        while True:
            try:
                with urllib.request.urlopen(f"{address}/health", timeout=5) as answer:
                    assert answer.status == 200
                break
            except (urllib.error.URLError, OSError):
                assert time.monotonic() < limit, (tmp_path / "log.txt").read_text()
                time.sleep(0.5)
        question = urllib.request.Request(
            f"{address}/api/2.0/mlflow/experiments/search",
            data=json.dumps({"max_results": 5}).encode(),
            headers={"Content-Type": "application/json"},
        )
        with urllib.request.urlopen(question, timeout=10) as answer:
            assert "experiments" in json.load(answer)
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=30) == 130
    assert not (tmp_path / "mlflow.db").exists()
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0
