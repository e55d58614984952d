"""A terminal that goes away, and output that nobody takes, cost a run nothing but its words."""

import json
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from workplace import COMMAND, SLOW, Workplace, until

LEADER = "import subprocess, sys; subprocess.run(sys.argv[1:])"
"""A shell that ends with its terminal: the kernel then tells what it started a second time."""


@contextmanager
def in_terminal(workplace: Workplace, *words: str) -> Iterator[tuple["subprocess.Popen[bytes]", int]]:
    """A command whose controlling terminal it is; yields the process and the terminal's other end."""
    ours, theirs = os.openpty()
    settings = os.environ | {"FAKE_BEHAVIOUR": json.dumps(SLOW)}
    command = ["setsid", "--ctty", *words, sys.executable, str(COMMAND), "run", "small.yaml"]
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    process = subprocess.Popen(command, cwd=workplace.folder, env=settings, **streams)  # type: ignore[call-overload]
    os.close(theirs)
    try:
        until(lambda: workplace.checkpoint("teacher") > 2)
        yield process, ours
    finally:
        process.kill()
        process.wait()


def runs_now(workplace: Workplace) -> bool:
    return "runs, process" in workplace.command("status").output


@pytest.mark.parametrize("shell", [[], [sys.executable, "-c", LEADER]], ids=["alone", "below a shell"])
def test_a_lost_terminal_leaves_a_checkpoint_and_status_tells_the_command(
    workplace: Workplace, shell: list[str]
) -> None:
    with in_terminal(workplace, *shell) as (process, terminal):
        os.close(terminal)
        process.wait(timeout=60)
        until(lambda: not runs_now(workplace))
    reached = workplace.checkpoint("teacher")
    assert 2 < reached < 120
    assert workplace.progress("teacher")["done"] == reached, "it stopped by itself at its checkpoint"  # type: ignore[index]
    status = workplace.command("status").output
    (line,) = [line for line in status.splitlines() if line.startswith("to go on: ")]
    again = workplace.command(*shlex.split(line.removeprefix("to go on: iowbc ")))
    assert again.code == 0, again.errors
    assert "teacher: runs - goes on from attempt 1" in again.output


def test_nohup_protects_a_run(workplace: Workplace) -> None:
    words = ["nohup", sys.executable, str(COMMAND), "run", "small.yaml"]
    settings = os.environ | {"FAKE_BEHAVIOUR": json.dumps(SLOW)}
    with (workplace.folder / "log").open("wb") as log:
        process = subprocess.Popen(words, cwd=workplace.folder, env=settings, stdout=log, stderr=log)
    until(lambda: workplace.checkpoint("teacher") > 2)
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=60) == 0
    assert "export: done" in (workplace.folder / "log").read_text()


def test_a_hangup_that_comes_twice_or_before_a_request_does_not_abort(workplace: Workplace) -> None:
    command = workplace.start("run", "small.yaml", behaviour={"teacher": {"steps": 3, "pause": 5.0}})
    until(lambda: workplace.progress("teacher"))
    for number in (signal.SIGHUP, signal.SIGHUP, signal.SIGTERM, signal.SIGHUP):
        command.signal(number)
        until(lambda number=number: number == signal.SIGHUP or "SIGTERM" in command.errors)  # type: ignore[misc]
    assert command.finish() == 130
    assert "checkpoint written" in command.errors
    assert "aborting" not in command.errors


def test_a_second_hangup_while_what_was_stopped_is_written_down_is_ignored() -> None:
    """In a process of its own: it is ignored to the end of the process."""
    program = """
import os, signal
from iowbc.pipeline.stop_request import StopRequest
for number in (signal.SIGTERM, signal.SIGHUP):
    with StopRequest() as request:
        os.kill(os.getpid(), number)
    assert request(), number
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    ignored = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    assert ignored == (number == signal.SIGHUP), number
os.kill(os.getpid(), signal.SIGHUP)
print("written down")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout == "written down\n", done.stderr


@pytest.mark.parametrize("target", ["/dev/full", "a terminal without its other end"])
def test_a_run_whose_output_nobody_takes_goes_on(workplace: Workplace, target: str) -> None:
    if target == "/dev/full":
        descriptor = os.open(target, os.O_WRONLY)
    else:
        ours, descriptor = os.openpty()
        os.close(ours)
    words = [sys.executable, str(COMMAND), "run", "small.yaml"]
    done = subprocess.run(
        words, cwd=workplace.folder, stdout=descriptor, stderr=subprocess.PIPE, text=True, check=False, timeout=60
    )
    os.close(descriptor)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert ("cannot be written any more: No space left" in done.stderr) == (target == "/dev/full")
    assert len(workplace.store.artifacts()) == 6


def test_a_listing_that_cannot_be_written_ends_with_a_sentence(workplace: Workplace) -> None:
    with open("/dev/full", "w") as full:
        words = [sys.executable, str(COMMAND), "ls"]
        done = subprocess.run(
            words, cwd=workplace.folder, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60
        )
    assert done.returncode == 1
    assert done.stderr.splitlines()[0].startswith("no space is left: ")
    assert "Exception ignored" not in done.stderr
