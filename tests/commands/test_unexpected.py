"""An unexpected error ends with one sentence, the place of the details, and the command that goes on."""

import errno
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from iowbc.commands.process import described

Command = Callable[..., "subprocess.CompletedProcess[str]"]

BROKEN = """
from iowbc.commands import listing
def broken(*arguments):
    raise KeyError("what nobody foresaw")
listing.known_recipes = broken
from iowbc.cli import main
main()
"""


def iowbc(folder: Path, *words: str, **settings: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "iowbc", *words]
    return subprocess.run(
        command, cwd=folder, env=os.environ | settings, capture_output=True, text=True, check=False, timeout=120
    )


def test_an_unforeseen_error_is_told_in_one_sentence_with_its_details_kept(tmp_path: Path) -> None:
    words = [sys.executable, "-c", BROKEN, "ls", "teacher"]
    settings = os.environ | {"TMPDIR": str(tmp_path)}
    done = subprocess.run(words, cwd=tmp_path, env=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    sentence, again = done.stderr.splitlines()
    assert "KeyError: 'what nobody foresaw'; the details are in " in sentence
    assert again == "to go on: iowbc ls teacher"
    (details,) = tmp_path.glob("iowbc-*.txt")
    assert "in broken" in details.read_text()


def test_a_full_disk_is_named_with_the_command_that_goes_on() -> None:
    text = described(OSError(errno.ENOSPC, "No space left on device", "runs/store/x"), ["run", "a b.yaml"])
    assert text.startswith("no space is left: runs/store/x cannot be written: No space left on device; make some")
    assert text.endswith("\nto go on: iowbc run 'a b.yaml'")


def test_details_that_cannot_be_written_are_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def full(*arguments: object, **settings: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("tempfile.NamedTemporaryFile", full)
    assert "ValueError: odd\n" in described(ValueError("odd"), ["ls"])


@pytest.mark.parametrize(
    ("words", "settings"),
    [
        (["ls"], {"COLUMNS": "abc"}),
        (["ls"], {"COLUMNS": "0"}),
        (["plan", "smoke"], {"PYTHONIOENCODING": "ascii"}),
    ],
)
def test_an_odd_terminal_breaks_nothing(tmp_path: Path, words: list[str], settings: dict[str, str]) -> None:
    done = iowbc(tmp_path, *words, **settings)
    assert done.returncode == 0, done.stderr


def test_closed_output_breaks_nothing(tmp_path: Path) -> None:
    command = shlex.join([sys.executable, "-m", "iowbc", "ls"])
    done = subprocess.run(["bash", "-c", f"{command} >&-"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["schema", "--output", "nowhere/x.json"], "--output nowhere/x.json: cannot be written"),
        (["play", "first", "--mass", "inf"], "--mass inf: should be 0 to 1000 kg"),
        (["play", "first", "--port", "8081"], "--port is that of the page that --web serves"),
        (["gc", "--unused", "--older-than", "nan"], "greater than or equal to 0"),
        (["plan", "first.yaml", "--set", ".".join(["a"] * 3000) + "=1"], "names 3000 levels"),
        (["plan", "first.yaml", "--set", "__class__.__init__=1"], "'__class__'"),
        (["plan", "first.yaml", "--set", "name=" + "a" * 300], "at most 64 characters"),
        (["plan", "first.yaml", "--set", "seed=4294967296"], "seed"),
        (["plan", "."], "is no regular file"),
        (["plan", "/dev/zero"], "is no regular file"),
        (["plan", "null.yaml"], "key 'extends'"),
        (["plan", "long.yaml"], "File name too long"),
        (["plan", "a" * 300], "File name too long"),
        (["diff", "a" * 300, "first"], "is neither a recipe that has run"),
        (["diff", "a" * 300 + ".yaml", "first"], "has no finished stage"),
        (["play", "a" * 300], "is neither a recipe that has run"),
        (["export", "a" * 300, "--web", "there"], "is neither a recipe that has run"),
        (["compare", "a" * 300, "first"], "is neither a recipe that has run"),
        (["plan", "first.yaml", "--set", "teacher.start=" + "a" * 290 + ".yaml"], "File name too long"),
        (["plan", "climbing.yaml"], "a recipe names a folder under robots/"),
    ],
)
def test_what_an_attacker_would_type_is_refused(folder: Path, command: Command, words: list[str], text: str) -> None:
    (folder / "null.yaml").write_text('extends: "a\\0b"\n')
    (folder / "long.yaml").write_text(f"extends: {'a' * 5000}.yaml\n")
    (folder / "climbing.yaml").write_text("robot: ../../elsewhere\n")
    done = command(*words)
    assert done.returncode == 2, done.stderr
    assert text in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "3",
        "{}",
        '{"updated": "never"}',
        '{"code": 3}',
        '{"attempts": 1e999, "forced": true}',
        "\x00",
        '{"forced": true, "done": 3, "total": 9, "sdconds": 2}',
    ],
)
def test_a_progress_of_other_types_is_no_progress(
    folder: Path, command: Command, key: Callable[..., str], text: str
) -> None:
    work = folder / "runs" / "work" / key("first", "teacher")
    work.mkdir(parents=True)
    (work / "progress.json").write_text(text)
    for words in (["status"], ["run", "first.yaml", "--force", "teacher"]):
        done = command(*words)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "text", ["3", '{"recipe": [], "inputs": 3}', '{"recipe": {"seed": 1, "seed.x": NaN}}', "[" * 100_000]
)
def test_ingredients_of_other_types_are_damage(
    folder: Path, command: Command, key: Callable[..., str], text: str
) -> None:
    (folder / "runs" / "store" / "teacher" / key("first", "teacher") / "key.json").write_text(text)
    for words in (["plan", "first.yaml"], ["diff", "first", "second"]):
        done = command(*words)
        assert done.returncode == 0, done.stderr
    assert "damaged: key.json has " in command("plan", "first.yaml").stdout.replace("\n", " ")


def test_ctrl_c_while_the_program_is_still_being_read_ends_it_without_a_word(tmp_path: Path) -> None:
    (tmp_path / "typer.py").write_text("import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(9)\n")
    done = iowbc(tmp_path, "ls", PYTHONPATH=os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
