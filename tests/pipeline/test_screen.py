"""What stands on a terminal after a run there, as an emulator of one shows it."""

import fcntl
import json
import os
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pyte
import pytest
from workplace import COMMAND, SLOW, Workplace, until

CTRL_C = b"\x03"


class Terminal:
    """A run in a terminal of so many columns, and its screen."""

    def __init__(self, folder: Path, columns: int, kind: str = "xterm-256color") -> None:
        self.ours, theirs = os.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
        words = ["setsid", "--ctty", sys.executable, str(COMMAND), "run", "small.yaml"]
        settings = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
        settings |= {"FAKE_BEHAVIOUR": json.dumps(SLOW), "TERM": kind}
        self.process = subprocess.Popen(words, cwd=folder, env=settings, stdin=theirs, stdout=theirs, stderr=theirs)
        os.close(theirs)
        os.set_blocking(self.ours, False)
        self._screen = pyte.Screen(columns, 50)
        self._stream = pyte.ByteStream(self._screen)

    def lines(self) -> list[str]:
        """What stands there now."""
        try:
            while written := os.read(self.ours, 65536):
                self._stream.feed(written)
        except OSError:  # nothing more at present, or the other end has closed
            pass
        return [line.rstrip() for line in self._screen.display]


@pytest.mark.parametrize("columns", [80, 120])
def test_ctrl_c_in_a_terminal_leaves_one_table_and_how_to_go_on(workplace: Workplace, columns: int) -> None:
    terminal = Terminal(workplace.folder, columns)
    try:
        until(lambda: any("%" in line for line in terminal.lines()) and workplace.checkpoint("teacher") > 2)
        os.write(terminal.ours, CTRL_C)
        until(lambda: terminal.lines() is not None and terminal.process.poll() is not None)
        shown = [line for line in terminal.lines() if line]
    finally:
        terminal.process.kill()
        terminal.process.wait()
    assert terminal.process.returncode == 130
    begun = [line.split()[0] for line in shown]
    assert begun.count("stage") == 1, "\n".join(shown)
    for stage in ("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"):
        assert begun.count(stage) == 1, "\n".join(shown)
    (row,) = [line for line in shown if line.split()[0] == "teacher"]
    assert row.split()[1] == "stopped"
    assert "^C" not in "\n".join(line for line in shown if line.split()[0] in ("stage", "teacher"))
    assert shown[-1].startswith("iowbc run small.yaml")


def test_a_terminal_without_cursor_control_shows_progress_in_lines(workplace: Workplace) -> None:
    terminal = Terminal(workplace.folder, 80, "dumb")
    try:
        until(lambda: any("%" in line for line in terminal.lines()))
        assert terminal.process.poll() is None
    finally:
        terminal.process.kill()
        terminal.process.wait()
