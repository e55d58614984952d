"""A page made from the export of an untrained policy, and a browser without a network to open it in."""

import functools
import json
import os
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import pytest
from exported_policies import made_up_generator, untrained

from iowbc.deploy import contract, exported_folder
from iowbc.errors import UsageError
from iowbc.evaluation.exported import golden_inputs
from iowbc.export import golden
from iowbc.export.folder import write_folder
from iowbc.export.graph import run_torch
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.web.page import npm_parts, parts_folder

DRAWING = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Words with which the browser draws in three dimensions without a GPU."""
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
CACHE = Path(os.environ.get("IOWBC_RUNS") or Path(__file__).parents[2] / "runs") / "npm"
LONGEST = 300.0
"""Time within which the browser answers, on a machine with other work, too [s]."""


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    return Recipe.model_validate({"name": "test", "export": {"acceptance": [{"mass": 4.0}], "golden_steps": 20}})


@pytest.fixture(scope="session")
def exported(recipe: Recipe, robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The exported folder of an untrained policy, with the golden vectors of a rollout that walks."""
    folder, rg = tmp_path_factory.mktemp("exported"), made_up_generator(robot, tmp_path_factory.mktemp("rg"))
    graph = untrained(recipe, robot, rg)
    statement = write_folder(folder, graph, recipe, rg, {"rg-fit": "a" * 8})
    inputs = golden.stacked(golden_inputs(Specification(recipe, robot.folder, rg), folder, lambda: False))
    outputs = golden.played(partial(run_torch, graph.settle), partial(run_torch, graph.step), inputs)
    golden.write_golden(inputs, outputs, folder / exported_folder.GOLDEN)
    contract.seal(statement, folder)
    return folder


@pytest.fixture(scope="session")
def cache() -> Path:
    """Where npm's packages are, for a browser that is there; only in continuous integration are they fetched."""
    if BROWSER is None:
        pytest.skip("chromium is not installed")
    if os.environ.get("CI") == "true":
        try:
            npm_parts(CACHE, print)
        except UsageError as reason:
            pytest.skip(str(reason))
    if shutil.which("node") is None or not (parts_folder(CACHE) / "node_modules").is_dir():
        pytest.skip(f"no npm packages in {CACHE}: `iowbc export WHAT --web DIR` fetches them, with node and a network")
    return CACHE


class _Listening(SimpleHTTPRequestHandler):
    """Serves a folder and hears what its pages post."""

    def __init__(self, *given: Any, told: "Queue[Any]", **named: Any) -> None:
        self.told = told
        super().__init__(*given, **named)

    def do_POST(self) -> None:
        self.told.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *words: object) -> None:
        """Says nothing."""


@contextmanager
def served(folder: Path) -> Iterator[tuple[str, "Queue[Any]"]]:
    """The address of a folder, and what pages post there."""
    told: Queue[Any] = Queue()
    handler = functools.partial(_Listening, directory=str(folder), told=told)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}", told
        finally:
            server.shutdown()
            thread.join()


def browser_words(profile: Path, *more: str) -> list[str]:
    """The browser's command line; nothing but this machine is reached."""
    assert BROWSER is not None
    words = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run"]
    words += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
    words += ["--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", f"--user-data-dir={profile}"]
    return [BROWSER, *words, *more]


@pytest.fixture
def answer_of(tmp_path: Path) -> Callable[..., Any]:
    """Opens a page of a folder in the browser, that may have to draw, and returns what it posts."""

    def ask(folder: Path, page: str, *, drawing: bool = False) -> Any:
        with served(folder) as (address, told):
            words = browser_words(tmp_path / "profile", *(DRAWING if drawing else ("--disable-gpu",)))
            words += ["--remote-debugging-port=0", f"{address}/{page}"]
            browser = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                return told.get(timeout=LONGEST)
            except Empty:
                pytest.fail(f"the browser told nothing in {LONGEST:.0f} s")
            finally:
                browser.terminate()
                browser.wait(30)

    return ask
