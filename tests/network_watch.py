"""Sees whom the processes of a test want to talk to: each connection that Python asks for, a proxy for all else."""

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

HOOK = """
import os, socket, sys

NEAR = {{"", "localhost", "127.0.0.1", "::1", "0.0.0.0", "::", socket.gethostname()}}

def told(event, arguments):
    if event not in ("socket.connect", "socket.sendto", "socket.getaddrinfo"):
        return
    address = arguments[0] if event == "socket.getaddrinfo" else arguments[1]
    host = address[0] if isinstance(address, tuple) else address
    if event != "socket.getaddrinfo" and not isinstance(address, tuple):
        return  # a socket of this machine's file system
    if host is not None and str(host) not in NEAR:
        with open({file!r}, "a") as file:
            file.write(f"{{event}} {{address}} of {{sys.argv}}\\n")

sys.addaudithook(told)
with open({file!r}, "a"):
    pass
"""


@dataclass
class Watch:
    """Whom processes with this environment wanted to reach outside of this machine."""

    environment: dict[str, str]
    file: Path
    proxy: socket.socket

    def contacts(self) -> list[str]:
        """Everybody so far. The watch itself is held: a process must have come by."""
        found = self.file.read_text().splitlines()
        while True:
            try:
                connection, asker = self.proxy.accept()
            except BlockingIOError:
                return found
            connection.close()
            found.append(f"by way of the proxy from {asker}")


@contextmanager
def watched(folder: Path) -> Iterator[Watch]:
    """A watch whose files lie in a folder."""
    folder.mkdir()
    file = folder / "contacts.txt"
    (folder / "sitecustomize.py").write_text(HOOK.format(file=str(file)))
    with socket.create_server(("127.0.0.1", 0)) as proxy:
        proxy.setblocking(False)
        address = f"http://127.0.0.1:{proxy.getsockname()[1]}"
        names = ("http_proxy", "https_proxy", "all_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY")
        paths = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH", ""))))
        near = dict.fromkeys(("no_proxy", "NO_PROXY"), "localhost,127.0.0.1")
        told = ("ORT_DISABLE_TELEMETRY", "MLFLOW_DISABLE_TELEMETRY")
        rest = {name: value for name, value in os.environ.items() if name not in told}
        yield Watch(rest | dict.fromkeys(names, address) | near | {"PYTHONPATH": paths}, file, proxy)
