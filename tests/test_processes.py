"""Processes of our own: who ends with whom, and how many threads they have."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from iowbc.processes import SINGLE_THREADED, available_cores, single_threaded

CHILD = "import os, time; from iowbc.processes import die_with_parent; die_with_parent({parent}); time.sleep(60)"
PARENT = """
import subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", {child!r}.format(parent=__import__("os").getpid())])
print(child.pid, flush=True)
time.sleep(60)
"""
PATIENCE = 10.0


def test_a_child_ends_when_its_parent_is_killed() -> None:
    command = [sys.executable, "-c", PARENT.format(child=CHILD)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        time.sleep(0.5)  # for the child to ask the kernel
        parent.send_signal(signal.SIGKILL)
        child.wait(PATIENCE)


def test_a_child_whose_parent_is_gone_already_ends_at_once() -> None:
    orphan = subprocess.run([sys.executable, "-c", CHILD.format(parent=1)], timeout=PATIENCE, check=False)
    assert orphan.returncode == 1


def test_single_threads_are_asked_of_processes_started_inside_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with single_threaded():
        assert {name: os.environ[name] for name in SINGLE_THREADED} == SINGLE_THREADED
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_no_more_cores_are_available_than_the_process_may_use() -> None:
    assert 1 <= available_cores() <= len(os.sched_getaffinity(0))


def test_mujoco_is_loaded_without_another_process() -> None:
    """Whoever kills a training while glfw's own Python runs would make that one print a traceback."""
    script = (
        "import subprocess; from iowbc.processes import name_glfw; name_glfw(); subprocess.Popen = None; "
        "import mujoco; print(mujoco.mjtObj.mjOBJ_BODY.value)"
    )
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout == "1\n"
