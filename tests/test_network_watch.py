"""The watch over connections sees what it is there to see."""

import subprocess
import sys
from pathlib import Path

from network_watch import watched

FAR = "import socket; socket.socket(socket.AF_INET, socket.SOCK_DGRAM).connect(('192.0.2.1', 9))"
NEAR = "import socket; socket.create_server(('127.0.0.1', 0)); socket.getaddrinfo('localhost', 9)"
PROXIED = "import urllib.request as r; r.urlopen(r.Request('http://192.0.2.1/', method='HEAD'), timeout=1)"


def test_connections_out_of_this_machine_are_seen(tmp_path: Path) -> None:
    for number, (program, count) in enumerate([(FAR, 1), (NEAR, 0), (PROXIED, 1)]):
        with watched(tmp_path / str(number)) as watch:
            subprocess.run([sys.executable, "-c", program], env=watch.environment, capture_output=True, check=False)
            assert len(watch.contacts()) == count, program
