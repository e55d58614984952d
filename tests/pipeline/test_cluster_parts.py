"""What nodes and driver exchange: folders by their digest, who they are, and how a stage goes."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from iowbc.errors import Damaged, StageFailed, UsageError
from iowbc.pipeline.cluster import folders, remote
from iowbc.pipeline.cluster.cluster import Cluster
from iowbc.pipeline.cluster.folders import Folder, files_of, placed, write_files
from iowbc.pipeline.cluster.identity import Identity, identity
from iowbc.pipeline.cluster.remote import NodeReport
from iowbc.pipeline.cluster.spread import _called
from iowbc.pipeline.store.digests import folder_digest
from iowbc.recipe.recipe import Recipe
from iowbc.stages import teacher


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """A folder of the driver's, and a node with an empty cache."""
    (tmp_path / "node").mkdir()
    monkeypatch.setattr(folders.tempfile, "gettempdir", lambda: str(tmp_path / "node"))
    folder = tmp_path / "driver"
    (folder / "tables").mkdir(parents=True)
    (folder / "tables" / "a.csv").write_text("1,2")
    (folder / "net.bin").write_bytes(bytes(range(256)))
    return Folder(str(folder), folder_digest(folder), (files_of(folder),))


def test_a_node_that_sees_the_drivers_folder_reads_it_there(source: Folder) -> None:
    assert placed(source, pytest.fail, copy=False) == Path(source.path)


def test_a_node_fetches_a_folder_once_and_mends_a_damaged_copy(source: Folder) -> None:
    fetched: list[Any] = []

    def fetch(content: Any) -> Any:
        fetched.append(content)
        return content

    first = placed(source, fetch, copy=True)
    assert first != Path(source.path)
    assert folder_digest(first) == source.digest
    assert first.name == Path(source.path).name, "the name of an artifact's folder is its key"
    assert placed(replace(source, path="/elsewhere/driver"), fetch, copy=False) == first
    assert len(fetched) == 1
    (first / "net.bin").write_bytes(b"no longer what it was")
    assert folder_digest(placed(source, fetch, copy=True)) == source.digest
    assert len(fetched) == 2


def test_what_arrives_otherwise_is_refused(source: Folder) -> None:
    with pytest.raises(Damaged, match="differs from its digest"):
        placed(source, lambda content: {**content, "net.bin": b""}, copy=True)


def test_a_machine_with_another_package_or_other_code_is_named_with_both(monkeypatch: pytest.MonkeyPatch) -> None:
    own = identity()
    assert own.mismatch(identity()) == ""
    other = replace(own, host="node7", versions={**own.versions, "mujoco": "3.0"}, code="f" * 64)
    told = own.mismatch(other)
    assert f"mujoco {own.versions['mujoco']} here, 3.0 on node7" in told
    assert f"code {own.code[:12]} here, ffffffffffff on node7" in told


@pytest.fixture
def strange() -> Identity:
    """A driver with another MuJoCo and other code."""
    own = identity()
    return replace(own, host="driver", versions={**own.versions, "mujoco": "3.0"}, code="f" * 64)


BOTH = r"mujoco 3\.0 here, \d+\.\d+\.\d+ on .*; code ffffffffffff here, [0-9a-f]{12} on "
"""How the driver's and the node's versions and code are told."""


def test_a_stage_is_refused_by_a_node_that_is_not_as_the_driver(strange: Identity, tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    nothing = Folder("", "", ())
    order = remote.Order(
        "task", strange, pytest.fail, Recipe(name="any"), "key", nothing, {}, None, "", "", "", 1, copy=False
    )
    outcome = remote.execute(order, (), None)
    assert outcome.state == "mismatch"
    assert re.match(BOTH, outcome.text)
    job = SimpleNamespace(out=tmp_path)
    with pytest.raises(StageFailed, match=rf"a node is not as this machine: {BOTH}"):
        object.__new__(Cluster)._conclude(teacher.STAGE, job, outcome)


def test_a_piece_is_refused_by_a_node_that_is_not_as_the_driver(strange: Identity) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    with pytest.raises(Damaged, match=rf"a node is not as the driver: {BOTH}"):
        _called(strange, pytest.fail, (), {}, copy=False)


class Heard:
    """A mailbox that keeps what it is told, and wants the second who tells to stop."""

    def __init__(self) -> None:
        self.told: list[list[Any]] = []

    def tell(self, events: list[Any]) -> bool:
        self.told.append(events)
        return len(self.told) > 1

    def wait(self) -> None: ...


def test_a_report_sends_the_last_progress_and_only_new_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "WORD_INTERVAL", 3600.0)
    line = Heard()
    report = NodeReport(line, tmp_path, sends=True)
    report.progress(1, 9)
    report.progress(2, 9, "at 2")
    report.metrics({"reward": 1.0}, 2)
    write_files(tmp_path, {"a.checkpoint": b"one", "a.previous": b"none"})
    assert not report.stopping()
    report.files(tmp_path / "a.checkpoint")
    report.flush(files=True)
    report.end(files=True)
    assert line.told == [
        [
            ("progress", 2, 9, "at 2"),
            ("metrics", {"reward": 1.0}, 2),
            ("files", {"a.checkpoint": b"one"}),
            ("shown", "a.checkpoint"),
        ],
        [],
    ]
    assert report.stopping()


HEAD, DYING = "a" * 56, "d" * 56
"""Numbers of nodes, as Ray writes them."""


class Asked:
    """Ray, as far as nodes are asked who they are; one of two dies before it answers."""

    def __init__(self, known: bool, strange: Identity | None = None) -> None:
        """known: whether Ray tells of a death once it has happened. strange: what the other node is instead."""
        from ray import exceptions

        self.exceptions, self.known, self.strange = exceptions, known, strange
        self.alive = [HEAD, DYING]

    def nodes(self) -> list[dict[str, Any]]:
        return [{"NodeID": one, "NodeManagerAddress": one[0], "Alive": one in self.alive} for one in (HEAD, DYING)]

    def remote(self, **settings: Any) -> Any:
        return lambda function: self

    def options(self, *, scheduling_strategy: Any) -> Any:
        return SimpleNamespace(remote=lambda: scheduling_strategy.node_id)

    def get(self, node: str) -> Any:
        if node == DYING and self.strange is not None:
            return self.strange
        if node == DYING:
            self.alive = [HEAD] if self.known else self.alive
            raise self.exceptions.NodeDiedError("it is gone")
        return identity()

    def shutdown(self) -> None:
        """Nothing to end."""


@pytest.mark.parametrize("known", [False, True])
def test_a_node_that_dies_while_it_is_asked_who_it_is_stops_nobody(known: bool) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    cluster = object.__new__(Cluster)
    cluster._ray = Asked(known)
    if known:
        cluster._require_alike()
        return
    with pytest.raises(UsageError, match="node d: cannot run iowbc"):
        cluster._require_alike()


def test_a_cluster_with_a_node_that_is_not_as_this_machine_is_refused(strange: Identity) -> None:
    pytest.importorskip("ray", reason="the extra `cluster` brings Ray")
    cluster = object.__new__(Cluster)
    cluster._ray = Asked(known=True, strange=strange)
    told = r"^node d: mujoco \d+\.\d+\.\d+ here, 3\.0 on driver; code [0-9a-f]{12} here, f{12} on driver\ninstall "
    with pytest.raises(UsageError, match=told):
        cluster._require_alike()
