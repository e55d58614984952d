"""MLflow's interface answers on this machine alone and ends with the command."""

import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest
from network_watch import watched

from iowbc.commands.ui import opened, ui, view
from iowbc.errors import UsageError
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import embedded_uri
from iowbc.pipeline.tracking.journal import Journal
from iowbc.pipeline.tracking.tracker import DESCRIPTION
from iowbc.stages.registry import STAGES

PUBLISHED = Path(__file__).parents[2] / "runs" / "published"


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_runs_that_are_recorded_on_a_server_are_not_looked_for_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
    with pytest.raises(UsageError, match=r"recorded in http://127\.0\.0\.1:9 \(MLFLOW_TRACKING_URI\)"):
        ui(free_port(), tmp_path / "runs")


def test_a_taken_port_is_refused_with_a_free_one(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = int(other.getsockname()[1])
        words = [sys.executable, "-m", "iowbc", "ui", "--port", str(port), "--runs", str(tmp_path / "runs")]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f"port {port} is taken; try --port ")


def recorded(runs: Runs, environment: Mapping[str, str]) -> None:
    """A run with a file and a description, as MLflow has it."""
    (runs.root / "store" / "eval").mkdir(parents=True)
    (runs.root / "store" / "eval" / "table.md").write_text("a table")
    with closing(Journal(runs.tracking / "made-up.jsonl")) as journal:
        journal.acquire()
        journal.write("journal", uri="", experiment="iowbc", recipe="box", digest="")
        journal.write("run", id="recipe", parent=None, name="box", tags={DESCRIPTION: "| a |"}, params={})
        journal.write("files", id="recipe", paths=["store/eval/table.md"])
        journal.write("end", id="recipe", status="FINISHED")
    words = [sys.executable, "-m", "iowbc.pipeline.tracking.delivery", str(runs.root)]
    assert subprocess.run(words, env=environment, check=False, timeout=120).returncode == 0


@pytest.mark.filterwarnings("ignore")  # of MLflow's own code
def test_a_damaged_database_is_named_with_a_remedy(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    runs.database.write_bytes(b"not a database" * 100)
    with pytest.raises(UsageError, match=r"mlflow\.db: .*file is not a database; if it is damaged, move it away"):
        opened(runs, embedded_uri(runs))


def test_the_columns_are_metrics_that_stages_leave() -> None:
    columns = view()["selectedColumns"]
    for stage, names in ((name, stage.columns) for name, stage in STAGES.items()):
        left = [json.loads(path.read_bytes())["metrics"] for path in PUBLISHED.glob(f"{stage}/*/summary.json")]
        for name in names:
            assert any(name in metrics for metrics in left), (stage, name)
            assert f"metrics.`{stage}/{name}`" in columns  # type: ignore[operator]


@pytest.mark.slow
def test_the_interface_of_a_moved_folder_answers_with_its_files_tells_nobody_and_ends(tmp_path: Path) -> None:
    with watched(tmp_path / "watch") as watch:
        answers_and_ends(tmp_path, watch.environment)
        assert watch.contacts() == []


def answers_and_ends(tmp_path: Path, environment: Mapping[str, str]) -> None:
    recorded(Runs(tmp_path / "before"), environment)
    (tmp_path / "before").rename(tmp_path / "runs")
    port = free_port()
    address = f"http://127.0.0.1:{port}"
    words = [sys.executable, "-m", "iowbc", "ui", "--port", str(port), "--runs", str(tmp_path / "runs")]

    def ask(path: str, **question: object) -> Any:
        data = json.dumps(question).encode()
        request = urllib.request.Request(address + path, data, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            return json.load(answer)

    log = (tmp_path / "log.txt").open("w")
    with log, subprocess.Popen(words, env=environment, stdout=log, stderr=log) as server, ExitStack() as at_last:
        at_last.callback(server.terminate)
        limit = time.monotonic() + 90.0
        while True:
            try:
                with urllib.request.urlopen(f"{address}/health", timeout=5) as answer:
                    assert answer.status == 200
                break
            except (urllib.error.URLError, OSError):
                assert time.monotonic() < limit, (tmp_path / "log.txt").read_text()
                time.sleep(0.5)
        page = next(line for line in (tmp_path / "log.txt").read_text().splitlines() if line.startswith(address))
        number = page.partition("#/experiments/")[2].partition("/runs?workflowType=machine_learning")[0]
        about = f"{address}/api/2.0/mlflow/experiments/get?experiment_id={number}"
        with urllib.request.urlopen(about, timeout=10) as answer:
            told = {tag["key"]: tag["value"] for tag in json.load(answer)["experiment"]["tags"]}
        assert json.loads(told[f"mlflow.sharedViewState.{page.partition('viewStateShareKey=')[2]}"]) == view()
        (run,) = ask("/api/2.0/mlflow/runs/search", experiment_ids=[number], max_results=5)["runs"]
        tags = {tag["key"]: tag["value"] for tag in run["data"]["tags"]}
        assert tags[DESCRIPTION] == "| a |"
        file = f"{address}/get-artifact?path=table.md&run_uuid={run['info']['run_id']}"
        with urllib.request.urlopen(file, timeout=10) as answer:
            assert answer.read() == b"a table"
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=30) == 130
    assert "Warning" not in (tmp_path / "log.txt").read_text()
    assert not (tmp_path / "mlflow.db").exists()
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0
