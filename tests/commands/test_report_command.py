"""`iowbc report` takes recipes that have run, and says where the page lies."""

import errno
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from iowbc import files
from iowbc.commands.compare import report
from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import Artifact


def test_a_report_is_of_recipes_and_an_html_file(folder: Path) -> None:
    with pytest.raises(UsageError, match="report takes recipes that have run"):
        report(["first/teacher"], folder / "page.html", runs=folder / "runs")
    with pytest.raises(UsageError, match=r"ends in \.html"):
        report(["first"], folder / "page.txt", runs=folder / "runs")


def test_a_disk_that_is_full_keeps_the_earlier_page(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(files, "synchronise", refuse)
    (folder / "page.html").write_text("earlier")
    with pytest.raises(OSError, match="No space left"):
        report(["first"], folder / "page.html", runs=folder / "runs")
    assert (folder / "page.html").read_text() == "earlier"


def test_what_several_runs_share_is_verified_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verified, verify = [], Artifact.verify
    monkeypatch.setattr(Artifact, "verify", lambda artifact: (verified.append(artifact.folder), verify(artifact)))
    report(["first", "second"], folder / "page.html", runs=folder / "runs")
    assert sorted(path.parent.name for path in verified).count("rg-fit") == 1
    assert len(verified) == len(set(verified)) > 0


def test_the_command_writes_a_page_about_two_runs(
    folder: Path, command: Callable[..., "subprocess.CompletedProcess[str]"]
) -> None:
    done = command("report", "first", "second")
    assert done.returncode == 0, done.stderr
    assert "runs/report/first-second.html" in done.stdout
    text = (folder / "runs" / "report" / "first-second.html").read_text()
    assert "teacher.steps: 4096 -&gt; 8192" in text
