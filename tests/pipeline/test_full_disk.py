"""A disk without room: what is finished stays, the text says what is full and gives the command that goes on."""

import errno
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from workplace import COMMAND, RECIPE, SLOW, Workplace, until

from iowbc.full_disk import is_disk_full, what_is_full


def assert_told(errors: str, command: str = "iowbc run small.yaml") -> None:
    """The last words: that something is full, and the command."""
    lines = errors.strip().splitlines()
    assert any("no space is left: " in line and "cannot be written: File too large" in line for line in lines), errors
    assert lines[-1].removeprefix("to go on: ") == command
    assert "Traceback" not in errors


@pytest.mark.parametrize("track", ["track: false", "tracking_patience: 0"])
def test_a_disk_that_fills_up_keeps_the_checkpoint_and_the_run_goes_on_later(workplace: Workplace, track: str) -> None:
    """No file grows from one moment on, as where 0 bytes are left; output goes to a pipe."""
    workplace.recipe.write_text(RECIPE.replace("track: false", track))
    words = [sys.executable, str(COMMAND), "run", "small.yaml"]
    settings = os.environ | {"FAKE_BEHAVIOUR": json.dumps(SLOW), "FAKE_SENDER": "off"}
    process = subprocess.Popen(
        words, cwd=workplace.folder, env=settings, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    until(lambda: workplace.checkpoint("teacher") > 2)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, 0))
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "teacher failed: no space is left: " in errors
    assert_told(errors)
    reached = workplace.checkpoint("teacher")
    assert reached > 2
    again = workplace.command("run", "small.yaml", FAKE_SENDER="off")
    assert again.code == 0, again.errors
    assert "rg-fit: cached" in again.output
    assert "teacher: runs - goes on from attempt 1" in again.output


@pytest.mark.parametrize("track", ["track: false", "tracking_patience: 0"])
def test_a_disk_that_is_full_before_the_first_stage_is_named(workplace: Workplace, track: str) -> None:
    workplace.recipe.write_text(RECIPE.replace("track: false", track))

    def full() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    words = [sys.executable, "-B", str(COMMAND), "run", "small.yaml"]
    done = subprocess.run(
        words, cwd=workplace.folder, capture_output=True, text=True, check=False, timeout=120, preexec_fn=full
    )
    assert done.returncode == 1
    assert_told(done.stderr)


def test_errors_that_say_that_nothing_fits_are_known_however_they_are_wrapped(tmp_path: Path) -> None:
    plain = OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "file"))
    wrapped = RuntimeError("the weights were not written")
    wrapped.__cause__ = plain
    library = RuntimeError("[enforce fail at inline_container.cc:783] . PytorchStreamWriter failed writing file data/3")
    for error in (plain, wrapped, library, OSError(errno.EFBIG, "File too large"), OSError(errno.EDQUOT, "")):
        assert is_disk_full(error)
    assert not is_disk_full(OSError(errno.EACCES, "Permission denied"))
    assert what_is_full(wrapped, ()) == f"{tmp_path / 'file'} cannot be written: No space left on device"
    copied = OSError(errno.ENOSPC, "No space left on device", "source", None, "target")
    assert what_is_full(copied, ()) == "target cannot be written: No space left on device"


def test_a_full_disk_is_named_with_what_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("iowbc.full_disk._free", lambda place: 4096 if place == tmp_path else 10**9)
    error = OSError(errno.ENOSPC, "No space left on device")
    assert what_is_full(error, (Path("/"), tmp_path)) == f"the disk of {tmp_path} is full (4,096 bytes are free)"
