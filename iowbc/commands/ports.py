"""Ports of this machine that pages are served on."""

import socket

from iowbc.errors import UsageError

HOST = "127.0.0.1"
LAST_PORT = 65_535


def require_free(port: int) -> None:
    """Raises `UsageError` with the next port that is free where this one is taken."""
    if not _free(port):
        other = next((other for other in range(port + 1, LAST_PORT + 1) if _free(other)), None)
        raise UsageError(f"port {port} is taken; try --port {other or 'with another number'}")


def _free(port: int) -> bool:
    """Whether a server may listen on a port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
    return True
