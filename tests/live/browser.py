"""A tab of headless Chromium, driven by its debugging protocol."""

import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from websockets.sync.client import ClientConnection, connect

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--window-size=420,420"),
)
PATIENCE = 120.0
"""How long the browser may take to begin [s]."""


class Tab:
    """One page in the browser."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._count = connection, 0

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer to a request of the protocol."""
        self._count += 1
        self._connection.send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while True:
            answer: dict[str, Any] = json.loads(self._connection.recv(timeout=PATIENCE))
            if answer.get("id") == self._count:
                return dict(answer["result"])

    def evaluate(self, expression: str) -> Any:
        """The value of an expression of JavaScript."""
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def press(self, key: str) -> None:
        """A key, by its name and by what it is called in the protocol."""
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=39)


class Browser:
    """Chromium with a profile of its own."""

    def __init__(self, profile: Path) -> None:
        assert BROWSER is not None
        self._profile, self._tabs = profile, []
        words = [BROWSER, *QUIET, f"--user-data-dir={profile}", "--remote-debugging-port=0", "about:blank"]
        self._process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._address = f"127.0.0.1:{self._port()}"

    def _port(self) -> int:
        told, until = self._profile / "DevToolsActivePort", time.monotonic() + PATIENCE
        while not (told.is_file() and told.read_text().strip()):
            assert time.monotonic() < until, "the browser does not begin"
            time.sleep(0.05)
        return int(told.read_text().split()[0])

    def open(self, url: str) -> Tab:
        """A new tab with a page."""
        request = urllib.request.Request(f"http://{self._address}/json/new?{url}", method="PUT")
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            socket = json.load(answer)["webSocketDebuggerUrl"]
        self._tabs.append(connect(socket, max_size=None))
        return Tab(self._tabs[-1])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for tab in self._tabs:
            tab.close()
        self._process.terminate()
        self._process.wait(timeout=PATIENCE)
