"""`iowbc report` takes recipes that have run, and says where the page lies."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from iowbc.commands.compare import report
from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store


def test_a_report_is_of_recipes_and_an_html_file(folder: Path) -> None:
    store, console = Store(Runs(folder / "runs")), Console()
    with pytest.raises(UsageError, match="report takes recipes that have run"):
        report(store, console, ["first/teacher"], folder / "page.html")
    with pytest.raises(UsageError, match=r"ends in \.html"):
        report(store, console, ["first"], folder / "page.txt")


def test_what_several_runs_share_is_verified_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verified, verify = [], Artifact.verify
    monkeypatch.setattr(Artifact, "verify", lambda artifact: (verified.append(artifact.folder), verify(artifact)))
    report(Store(Runs(folder / "runs")), Console(), ["first", "second"], folder / "page.html")
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
