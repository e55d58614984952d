"""What nodes and driver exchange: folders by their digest, who they are, and how a stage goes."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("ray", reason="the extra `cluster` brings Ray")

import ray

from iowbc.errors import Damaged, StageFailed
from iowbc.files import folder_digest
from iowbc.pipeline.cluster import folders, stage_task
from iowbc.pipeline.cluster.folders import SharedFolder, files_of, placed, write_files
from iowbc.pipeline.cluster.stage_task import NodeReport
from iowbc.pipeline.code import identity, mismatch


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SharedFolder:
    """A folder of the driver's, and a node with an empty cache."""
    (tmp_path / "node").mkdir()
    monkeypatch.setattr(folders.tempfile, "gettempdir", lambda: str(tmp_path / "node"))
    folder = tmp_path / "driver"
    (folder / "tables").mkdir(parents=True)
    (folder / "tables" / "a.csv").write_text("1,2")
    (folder / "net.bin").write_bytes(bytes(range(256)))
    return SharedFolder(str(folder), folder_digest(folder), (files_of(folder),), identity(), copy=False)


def test_a_node_that_sees_the_drivers_folder_reads_it_there(source: SharedFolder) -> None:
    assert placed(source) == Path(source.path)


def test_a_node_fetches_a_folder_once_and_mends_a_damaged_copy(
    source: SharedFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    fetched: list[Any] = []

    def fetch(content: Any) -> Any:
        fetched.append(content)
        return content

    monkeypatch.setattr(ray, "get", fetch)
    copied = replace(source, copy=True)
    first = placed(copied)
    assert first != Path(source.path)
    assert folder_digest(first) == source.digest
    assert first.name == Path(source.path).name, "the name of an artifact's folder is its key"
    assert placed(replace(source, path="/elsewhere/driver")) == first
    assert len(fetched) == 1
    (first / "net.bin").write_bytes(b"no longer what it was")
    assert folder_digest(placed(copied)) == source.digest
    assert len(fetched) == 2


def test_what_arrives_otherwise_is_refused(source: SharedFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray, "get", lambda content: {**content, "net.bin": b""})
    with pytest.raises(Damaged, match="differs from its digest"):
        placed(replace(source, copy=True))


def test_a_machine_with_another_package_or_other_code_is_named_with_both(monkeypatch: pytest.MonkeyPatch) -> None:
    own = identity()
    assert mismatch(own, identity()) == ""
    told = mismatch(own, {**own, "host": "node7", "mujoco": "3.0", "code": "f" * 12})
    assert f"mujoco {own['mujoco']} here, 3.0 on node7" in told
    assert f"code {own['code']} here, ffffffffffff on node7" in told


def test_a_node_that_is_not_as_the_driver_is_refused_with_both_versions(source: SharedFolder) -> None:
    driver = {**identity(), "host": "driver", "mujoco": "3.0", "code": "f" * 12}
    both = r"code ffffffffffff here, [0-9a-f]{12} on .*; mujoco 3\.0 here, \d+\.\d+\.\d+ on "
    with pytest.raises(StageFailed, match=rf"a node is not as the driver: {both}.*; install the same on both"):
        placed(replace(source, driver=driver))


class HeardMailbox:
    """A mailbox that keeps what it is told, and wants the second who reports to stop."""

    def __init__(self) -> None:
        self.told: list[list[Any]] = []
        self.report = SimpleNamespace(remote=self._report)

    def _report(self, task: str, events: list[Any]) -> bool:
        self.told.append(events)
        return len(self.told) > 1


def test_a_report_sends_the_last_progress_and_only_new_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage_task, "REPORT_INTERVAL", 3600.0)
    monkeypatch.setattr(ray, "wait", lambda answers, timeout: (answers, []))
    monkeypatch.setattr(ray, "get", lambda answer: answer)
    mailbox = HeardMailbox()
    report = NodeReport(mailbox, "task", tmp_path, sends=True)
    report.progress(1, 9)
    report.progress(2, 9, "at 2")
    report.metrics({"reward": 1.0}, 2)
    write_files(tmp_path, {"a.checkpoint": b"one", "a.previous": b"none"})
    assert not report.stopping()
    report.gather()
    report.flush()
    report.gather()
    report.end()
    assert mailbox.told == [
        [
            ("progress", 2, 9, "at 2"),
            ("metrics", {"reward": 1.0}, 2),
            ("files", {"a.checkpoint": b"one"}),
        ],
        [],
    ]
    report.flush()
    assert report.stopping()
