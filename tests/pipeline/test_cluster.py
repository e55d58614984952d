"""A sweep on Ray gives what a local one gives, loses nothing to Ctrl-C or a dead node, and leaves no process behind."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from workplace import Workplace, until

from iowbc.pipeline.cluster.loopback import free_port, secured

pytest.importorskip("ray", reason="the extra `cluster` brings Ray")

PATIENCE = 240.0
"""Seconds that Ray may take to start on a busy machine."""
WORDS = ("sweep", "small.yaml", "--set", "seed=0..2", "--set", "execution.copy_files=true", "--until", "teacher")
RAY = ("--jobs", "3", "--workers", "1", "--engine", "ray")


def log(workplace: Workplace, seed: int) -> str:
    path = workplace.folder / "runs" / "sweeps" / "small-seed" / "logs" / f"small-seed-{seed}.log"
    return path.read_text() if path.exists() else ""


def in_teacher(workplace: Workplace) -> int:
    """Points whose teacher has begun on a node since a sweep was started."""
    return sum("teacher: runs on" in log(workplace, seed) for seed in range(3))


def of_ray() -> set[int]:
    """Processes of any Ray."""
    found = set()
    for process in psutil.process_iter(["cmdline", "name"]):
        words = " ".join(process.info["cmdline"] or [])
        if "raylet" in words or "gcs_server" in words or str(process.info["name"]).startswith("ray::"):
            found.add(process.pid)
    return found


def kill(node: "subprocess.Popen[bytes]") -> None:
    """A node's machine goes away: all its processes at once."""
    for process in [*psutil.Process(node.pid).children(recursive=True), psutil.Process(node.pid)]:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
    node.wait()


def started(log: Path, *words: str) -> "subprocess.Popen[bytes]":
    """A node of Ray beside others of this machine; on a busy one Ray gives itself up after 15 s, and is asked again."""
    start = [sys.executable, "-c", "from ray.scripts.scripts import main; main()", "start", "--block", *words]
    start += ["--disable-usage-stats", "--include-log-monitor=false"]
    for _ in range(4):
        with log.open("wb") as output:
            process = subprocess.Popen(start, stdout=output, stderr=output, env=os.environ | {"PYTHONUNBUFFERED": "1"})
        until(lambda: process.poll() is not None or "Ray runtime started" in log.read_text(), PATIENCE)  # noqa: B023
        if process.poll() is None:
            return process
    raise AssertionError(log.read_text())


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """A cluster of two nodes: its address, and the node with one core that is not its head."""
    behaviour = {"teacher": {"gate": str(tmp_path / "gate"), "pause": 0.05}}
    for name, value in {**secured(), "FAKE_BEHAVIOUR": json.dumps(behaviour)}.items():
        monkeypatch.setenv(name, value)  # what runs on a node has the node's environment
    address = f"{socket.gethostbyname(socket.gethostname())}:{free_port()}"
    host, _, port = address.partition(":")
    place = [f"--node-ip-address={host}", "--include-dashboard=false"]
    head = started(tmp_path / "head.log", "--head", f"--port={port}", "--num-cpus=2", "--no-monitor", *place)
    second = started(tmp_path / "second.log", f"--address={address}", "--num-cpus=1", place[0])
    yield address, second
    for process in (second, head):
        if process.poll() is None:
            kill(process)


@pytest.mark.timeout(900)
def test_ctrl_c_leaves_checkpoints_and_no_process(workplace: Workplace, tmp_path: Path) -> None:
    before = of_ray()
    behaviour = {"teacher": {"gate": str(tmp_path / "gate"), "pause": 0.05}}
    stopped = workplace.start(*WORDS, *RAY, "--address", "local", behaviour=behaviour)
    until(lambda: in_teacher(workplace) >= 1, PATIENCE)
    assert re.search(r"Ray at 127.0.0.1:\d+: 1 node, ", stopped.output), "it listens on this machine alone"
    stopped.signal(signal.SIGINT)
    assert stopped.finish() == 130, stopped.errors
    until(lambda: of_ray() <= before)
    stopped_at = sum("checkpoint written" in log(workplace, seed) for seed in range(3))
    came_back = list(workplace.folder.glob("runs/work/*/scratch/checkpoint.one"))
    assert len(came_back) == stopped_at >= 1, "what nodes on their own disks have reached comes back"


@pytest.mark.timeout(900)
def test_a_dead_node_costs_nothing_that_is_finished_and_changes_nothing(
    workplace: Workplace, nodes: tuple[str, "subprocess.Popen[bytes]"], tmp_path: Path
) -> None:
    address, second = nodes
    gate = tmp_path / "gate"
    sweep = workplace.start(*WORDS, *RAY, "--address", address)
    until(lambda: in_teacher(workplace) == 3, PATIENCE)
    kill(second)
    until(lambda: any("was lost" in log(workplace, seed) for seed in range(3)), PATIENCE)
    gate.touch()
    assert sweep.finish() == 0, sweep.errors

    assert workplace.command(*WORDS, "--runs", "here").code == 0
    stored = {
        root: {
            path.parent.name: json.loads(path.read_text())["digest"]
            for path in (tmp_path / root).glob("store/*/*/manifest.json")
        }
        for root in ("runs", "here")
    }
    assert len(stored["here"]) == 9
    assert stored["runs"] == stored["here"]
