"""The server of the viewer, for this machine alone."""

import io
import logging
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

import viser

from iowbc.errors import UsageError
from iowbc.live.border import check_values, own_pages_only

HOST = "127.0.0.1"


class LocalServer(viser.ViserServer):  # type: ignore[misc]
    """A server whose page nobody can pass on."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Would lead the page through a server of the library's authors."""


@contextmanager
def serving(port: int) -> Iterator[LocalServer]:
    """A server on a port of this machine, 0 for any that is free; it ends with the block. Only its own page reaches it.

    Raises UsageError where the port is taken; the library would take the next one.
    """
    # Browsers open connections ahead and close them unused, which is no error.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with redirect_stdout(io.StringIO()), own_pages_only():  # the library prints a frame of its own
        server = LocalServer(host=HOST, port=port, verbose=False, label="iowbc")
    try:
        if port and server.get_port() != port:
            raise UsageError(f"port {port} is taken; try another --port")
        check_values(server)
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()
