"""Every event reaches MLflow at least once and counts once, whichever call fails or journal is damaged."""

import json
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from workplace import RECIPE, Workplace

from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking import delivery as module
from iowbc.pipeline.tracking.delivery import Delivery
from iowbc.pipeline.tracking.journal import Journal, sent_path
from iowbc.pipeline.tracking.tracker import start_sender


class Server:
    """What MLflow keeps of the runs it is told of, as its database does: a metric or parameter told twice is kept once.

    The call with number `failing` is carried out or not, and raises in either case.
    """

    def __init__(self, failing: int = -1, carried_out: bool = False) -> None:
        self.runs: dict[str, dict[str, Any]] = {}
        self.calls, self.failing, self.carried_out = 0, failing, carried_out

    def _turn(self) -> Iterator[None]:
        self.calls += 1
        failed = self.calls == self.failing
        if failed and not self.carried_out:
            raise ConnectionError("away")
        yield
        if failed:
            raise ConnectionError("away before it answered")

    def search_runs(self, experiments: list[str], condition: str, max_results: int) -> list[Any]:
        for _ in self._turn():
            origin = condition.split("'")[1]
            found = [name for name, run in self.runs.items() if run["tags"][module.ORIGIN_TAG] == origin]
        return [SimpleNamespace(info=SimpleNamespace(run_id=name)) for name in found]

    def create_run(self, experiment: str, start_time: int, tags: Mapping[str, str], run_name: str) -> Any:
        for _ in self._turn():
            name = f"run{len(self.runs)}"
            self.runs[name] = {
                "name": run_name,
                "tags": dict(tags),
                "params": {},
                "metrics": set(),
                "status": "RUNNING",
            }
        return SimpleNamespace(info=SimpleNamespace(run_id=name))

    def log_batch(self, run: str, metrics: Any = (), params: Any = (), tags: Any = ()) -> None:
        for _ in self._turn():
            kept = self.runs[run]
            kept["metrics"] |= {(metric.key, metric.value, metric.timestamp, metric.step) for metric in metrics}
            kept["params"] |= {param.key: param.value for param in params}
            kept["tags"] |= {tag.key: tag.value for tag in tags}

    def set_terminated(self, run: str, status: str, time: int) -> None:
        for _ in self._turn():
            self.runs[run]["status"] = status


def told(runs: Runs) -> Path:
    """A journal of a finished run with one stage."""
    path = runs.tracking / "one.jsonl"
    with closing(Journal(path)) as journal:
        assert journal.acquire()
        journal.write("journal", uri="sqlite://", experiment="tried", recipe="small", digest="")
        journal.write("run", id="recipe", parent=None, name="small", tags={}, params={"seed": "3"})
        journal.write("run", id="teacher", parent="recipe", name="teacher", tags={}, params={"teacher.steps": "4096"})
        for step in range(3):
            journal.write("metrics", id="teacher", values={"count": float(step)}, step=step)
        journal.write("tags", id="teacher", tags={"iowbc.artifact": "here"})
        journal.write("end", id="teacher", status="KILLED")
        journal.write("end", id="recipe", status="KILLED")
    return path


def delivered(runs: Runs, path: Path, server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Send with a new sender after each failure, as after a death."""
    monkeypatch.setattr(module, "open_experiment", lambda runs, uri, name: (server, "0"))
    for _ in range(3):
        if Delivery(runs, path).advance():
            return
    raise AssertionError("not delivered")


@pytest.mark.parametrize("carried_out", [False, True])
@pytest.mark.parametrize("forgotten", [False, True])
def test_whichever_call_fails_mlflow_ends_up_with_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, carried_out: bool, forgotten: bool
) -> None:
    runs, whole = Runs(tmp_path), Server()
    path = told(runs)
    delivered(runs, path, whole, monkeypatch)
    assert [run["params"] for run in whole.runs.values()] == [{"seed": "3"}, {"teacher.steps": "4096"}]
    assert len(whole.runs["run1"]["metrics"]) == 3
    for failing in range(1, whole.calls + 1):
        sent_path(path).unlink()
        server = Server(failing, carried_out)
        delivered(runs, path, server, monkeypatch)
        if forgotten:
            sent_path(path).write_text("nonsense")
            delivered(runs, path, server, monkeypatch)
        assert server.runs == whole.runs, failing


@pytest.mark.parametrize("parent_first", [False, True])
def test_a_run_may_belong_to_one_of_another_journal_whichever_is_sent_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parent_first: bool
) -> None:
    runs, server = Runs(tmp_path), Server()
    for stem, parent in (("above", None), ("below", "above/recipe")):
        with closing(Journal(runs.tracking / f"{stem}.jsonl")) as journal:
            assert journal.acquire()
            journal.write("journal", uri="sqlite://", experiment="tried", recipe=stem, digest="")
            journal.write("run", id="recipe", parent=parent, name=stem, tags={"told": stem}, params={"is": stem})
    for stem in ("above", "below") if parent_first else ("below", "above"):
        delivered(runs, runs.tracking / f"{stem}.jsonl", server, monkeypatch)
    assert sorted(run["params"]["is"] for run in server.runs.values()) == ["above", "below"]
    (above,) = [name for name, run in server.runs.items() if run["tags"]["told"] == "above"]
    (below,) = [run for run in server.runs.values() if run["tags"]["told"] == "below"]
    assert below["tags"]["mlflow.parentRunId"] == above


def test_a_flipped_bit_costs_its_line_and_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs, whole = Runs(tmp_path / "whole"), Server()
    delivered(runs, told(runs), whole, monkeypatch)
    size = told(Runs(tmp_path / "size")).stat().st_size
    for place in range(0, size, 29):
        runs, server = Runs(tmp_path / str(place)), Server()
        path = told(runs)
        written = bytearray(path.read_bytes())
        written[place] ^= 4
        path.write_bytes(written)
        delivered(runs, path, server, monkeypatch)
        kept = {metric[1] for run in server.runs.values() for metric in run["metrics"]}
        if any(runs.damaged.glob("journal-one-*.txt")):
            assert "is damaged and put aside in" in capsys.readouterr().out
            assert len(kept) >= 1, "two lines are lost at most, where the end of one is hit"
        else:
            assert kept == {0.0, 1.0, 2.0}, "the word before the checksum was hit"
        assert {run["name"] for run in server.runs.values()} <= {"small", "teacher", "recipe"}
        assert len(server.runs) == 2


def test_a_damaged_journal_stops_no_run_and_no_other_journal(
    workplace: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    workplace.recipe.write_text(RECIPE.replace("track: false", "tracking_patience: 0"))
    tracking = workplace.store.runs.tracking
    tracking.mkdir(parents=True)
    for number, text in enumerate(["{", "[]", "null", '{"event": 3}', '{"event": "run"}', "\udcff\x00", "[" * 100_000]):
        path = tracking / f"20200101-00000{number}-small-{number}.jsonl"
        path.write_bytes((text + "\n").encode("utf-8", "surrogateescape"))
        sent_path(path).write_text(json.dumps(["wrong"]))
    command = workplace.command("run", "small.yaml", FAKE_SENDER="off")
    assert command.code == 0, command.errors
    for path in sorted(tracking.glob("2020*.jsonl")):
        delivered(workplace.store.runs, path, Server(), monkeypatch)
    status = workplace.command("status").output
    assert "7 damaged lines of MLflow's journals were put aside, as runs/damaged/journal-" in status
    assert "MLflow lacks something of 1 runs" in status


def test_a_line_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    with closing(Journal(tmp_path / "journal.jsonl")) as journal:
        journal.write("end", id="recipe", status="FINISHED")
        whole = journal.path.read_bytes()

        class Full:
            def write(self, line: bytes) -> int:
                with journal.path.open("ab") as file:
                    file.write(line[:7])
                if len(line) < 60:
                    raise OSError(28, "No space left on device")
                return 7

            def fileno(self) -> int:
                return kept.fileno()

        kept, journal._file = journal._file, Full()  # type: ignore[assignment]
        with pytest.raises(OSError, match=r"journal\.jsonl"):
            journal.write("end", id="teacher", status="FINISHED")
        journal._file = kept
        assert journal.path.read_bytes() == whole


def test_a_log_that_cannot_be_written_keeps_no_sender_from_starting(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    (runs.tracking / "sender.log").mkdir(parents=True)
    assert start_sender(runs).wait(timeout=120) == 0
