"""A sweep on Ray gives what a local one gives, loses nothing to Ctrl-C or a dead node, and leaves no process behind."""

import json
import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from local_nodes import local_nodes
from ray_processes import HEALTH, below, kill, kill_a_node, listens_on, name, nodes, rays
from workplace import Command, Workplace, until

pytest.importorskip("ray", reason="the extra `cluster` brings Ray")

PATIENCE = 240.0
"""Seconds that Ray may take for anything on a busy machine."""
WORDS = ("sweep", "small.yaml", "--set", "seed=0..2", "--set", "execution.copy_files=true", "--until", "teacher")
RAY = ("--jobs", "3", "--workers", "64", "--engine", "ray", "--address")
"""Each point takes a whole node for its teacher."""


class Sweep:
    """A sweep whose teachers wait for `gate` after their first step."""

    def __init__(self, workplace: Workplace) -> None:
        self.workplace = workplace
        self.gate = workplace.folder / "gate"
        self.behaviour: dict[str, Any] = {
            "teacher": {"gate": str(self.gate), "pause": 0.05},
            "rg-dataset": {"pieces": 4},
        }
        self.commands: list[Command] = []

    def start(self, address: str) -> Command:
        self.commands.append(self.workplace.start(*WORDS, *RAY, address, behaviour=self.behaviour, **HEALTH))
        return self.commands[-1]

    def log(self, seed: int) -> str:
        path = self.workplace.folder / "runs" / "sweeps" / "small-seed" / "logs" / f"small-seed-{seed}.log"
        return path.read_text() if path.exists() else ""

    def wait(self, text: str, points: int) -> None:
        """Until so many points have said something. Fails at once when the sweep ends before."""

        def said() -> bool:
            count = sum(text in self.log(seed) for seed in range(3))
            command = self.commands[-1]
            ended = count < points and command.process.poll() is not None
            assert not ended, f"ended before: {command.output}{command.errors}{[self.log(seed) for seed in range(3)]}"
            return count >= points

        until(said, PATIENCE)

    def processes(self) -> list[psutil.Process]:
        """Those of Ray that the sweep has started."""
        return rays(self.commands[-1].process.pid)


@pytest.fixture
def sweep(workplace: Workplace) -> Iterator[Sweep]:
    """A sweep that has not begun; whatever it leaves running is killed."""
    made = Sweep(workplace)
    yield made
    for command in made.commands:
        kill(below(command.process.pid))
        command.process.kill()
        command.process.wait()


@pytest.mark.timeout(900)
def test_ctrl_c_leaves_checkpoints_and_no_process(sweep: Sweep) -> None:
    command = sweep.start("local")
    sweep.wait("teacher: runs on", 1)
    assert re.search(r"Ray at 127.0.0.1:\d+: 1 node, ", command.output)
    processes = sweep.processes()
    listening = set[str]().union(*map(listens_on, processes))
    assert listening <= {"127.0.0.1", "::ffff:127.0.0.1"}, "it listens on this machine alone"
    assert listening
    command.signal(signal.SIGINT)
    assert command.finish() == 130, command.errors
    until(lambda: not any(map(name, processes)), PATIENCE)
    stopped = sum("checkpoint written" in sweep.log(seed) for seed in range(3))
    came_back = list(sweep.workplace.folder.glob("runs/work/*/scratch/checkpoint.one"))
    assert len(came_back) == stopped >= 1, "what nodes on their own disks have reached comes back"


@pytest.mark.timeout(900)
def test_a_dead_node_costs_nothing_that_is_finished_and_changes_nothing(
    sweep: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable, value in {**HEALTH, "FAKE_BEHAVIOUR": json.dumps(sweep.behaviour)}.items():
        monkeypatch.setenv(variable, value)  # for stages on the nodes, which are not the sweep's own
    with local_nodes([1, 1]) as address:
        command = sweep.start(address)
        sweep.wait("teacher: runs on", 2)
        kill_a_node(nodes(os.getpid())[0])
        sweep.wait("was lost", 1)
        sweep.gate.touch()
        assert command.finish() == 0, command.errors

    assert sweep.workplace.command(*WORDS, "--runs", "here").code == 0
    stored = {
        root: {
            path.parent.name: json.loads(path.read_text())["digest"]
            for path in (tmp_path / root).glob("store/*/*/manifest.json")
        }
        for root in ("runs", "here")
    }
    assert len(stored["here"]) == 9
    assert stored["runs"] == stored["here"]
