"""Ctrl-C before a run has begun is answered from the first moment on, and never with a traceback."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from iowbc.commands.process import INTERRUPTED, leave

ROOT = Path(__file__).parents[2]
INTERRUPTED_IMPORT = """
import signal
from iowbc.commands.process import leave
signal.signal(signal.SIGINT, leave)
try:
    import interrupted
except BaseException as error:
    print("the caller met", repr(error))
"""


def python(*words: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    settings = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=settings, capture_output=True, text=True, timeout=60, check=False
    )


def test_one_that_comes_while_a_module_is_read_is_no_error_of_that_module(tmp_path: Path) -> None:
    (tmp_path / "interrupted.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n")
    ended = python("-c", INTERRUPTED_IMPORT, folder=tmp_path)
    assert (ended.returncode, ended.stdout, ended.stderr) == (INTERRUPTED, "", "")


def test_any_other_closes_what_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os._exit", lambda code: pytest.fail("ended without closing anything"))
    with pytest.raises(SystemExit, match=str(INTERRUPTED)):
        leave(signal.SIGINT, sys._getframe())


def test_nothing_is_read_before_the_first_can_be_answered(tmp_path: Path) -> None:
    words = "import json, sys; before = {*sys.modules}; import iowbc.__main__"
    read = f"{words}; print(json.dumps([*{{*sys.modules}} - before]))"
    modules = set(json.loads(python("-S", "-c", read, folder=tmp_path).stdout))
    assert {"iowbc", "iowbc.__main__"} <= modules
    assert len(modules) < 15, f"what is slow to read comes later: {sorted(modules)}"
    assert "typing" not in modules
