"""The server of the viewer, for this machine alone: requests of its own page, values within each control's range."""

import io
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import viser
import websockets.asyncio.server as library
from viser import _messages as messages
from viser.infra import ClientId, WebsockMessageHandler

from iowbc.errors import UsageError

LOCAL_NAMES = ("127.0.0.1", "localhost", "::1")
"""Names of this machine in a page's address; its port may be another one, as through a tunnel."""
LARGEST_MESSAGE = 1_000_000
"""Bytes of a message from a browser; those of the viewer have some hundreds."""
MOST_CONNECTIONS = 32
"""Maximum number of open pages; each receives the whole scene and all changes."""
UNUSED = (
    *(messages.FileTransferStartUpload, messages.FileTransferPart, messages.CommandTriggerMessage),
    *(messages.GuiFormSubmitMessage, messages.GuiFormDirtyMessage),
    *(messages.ShareUrlRequest, messages.ShareUrlDisconnect),
)
"""Messages of which the page has no need: uploads would be kept in memory."""


def refusal(headers: Any, connected: int) -> tuple[HTTPStatus, str] | None:
    """Reason why a request is not answered: another page that the user visits would steer the robot."""
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or _name(f"http://{hosts[0]}") not in LOCAL_NAMES:
        return HTTPStatus.FORBIDDEN, f"Host {hosts}: open the page as http://127.0.0.1:PORT or http://localhost:PORT\n"
    if origins and origins != [f"http://{hosts[0]}"]:
        return HTTPStatus.FORBIDDEN, f"Origin {origins}: only the viewer's own page may connect\n"
    if headers.get_all("Upgrade") and connected >= MOST_CONNECTIONS:
        return HTTPStatus.SERVICE_UNAVAILABLE, f"{connected} pages are open: close some\n"
    return None


def _name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


@contextmanager
def own_pages_only() -> Iterator[None]:
    """Servers started within the block reject requests with a `refusal`. Raises RuntimeError if viser bypasses this."""
    serve, begun = library.serve, []

    def watched(*given: Any, process_request: Any, **settings: Any) -> Any:
        def process(connection: Any, request: Any) -> Any:
            if refused := refusal(request.headers, len(connection.server.connections)):
                return connection.respond(*refused)
            response = process_request(connection, request)
            if response is not None:
                response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            return response

        begun.append(True)
        return serve(*given, process_request=process, **settings | {"max_size": LARGEST_MESSAGE})

    library.serve = watched
    try:
        yield
    finally:
        library.serve = serve
    if not begun:
        raise RuntimeError(f"viser {viser.__version__} serves in a way that cannot be watched; install its version 1.1")


def check_values(server: viser.ViserServer) -> None:
    """Allow browsers only to change values of controls, within their ranges."""
    gui, incoming = server.gui, server._websock_server

    async def changed(client: ClientId, message: messages.GuiUpdateMessage) -> None:
        handle = gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is not None and isinstance(message.updates, dict) and "value" in message.updates:
            value = within(handle, message.updates["value"])
            await gui._handle_gui_updates(client, replace(message, updates={"value": value}))

    incoming.unregister_handler(messages.GuiUpdateMessage)
    incoming.register_handler(messages.GuiUpdateMessage, changed)
    _leave_out(incoming)
    incoming.on_client_connect(_leave_out)


def _leave_out(handler: WebsockMessageHandler) -> None:
    for kind in UNUSED:
        handler._incoming_handlers.pop(kind, None)


def within(control: Any, value: Any) -> Any:
    """A browser's value clipped to a control's range; the current value if the type is wrong."""
    now = control.value
    if isinstance(now, bool):
        return value if isinstance(value, bool) else now
    if isinstance(control, viser.GuiDropdownHandle):
        return value if value in control.options else now
    if not isinstance(now, int | float) or type(value) not in (int, float) or not math.isfinite(value):
        return now
    low, high = control.min, control.max
    return type(now)(min(max(value, -math.inf if low is None else low), math.inf if high is None else high))


class LocalServer(viser.ViserServer):  # type: ignore[misc]
    """A server whose page cannot be shared."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Would lead the page through a server of the library's authors."""


@contextmanager
def serving(port: int) -> Iterator[LocalServer]:
    """A server on a port of this machine, 0 for any that is free; it ends with the block. Only its own page reaches it.
    Raises UsageError where the port is taken; the library would take the next one."""
    # Browsers open connections in advance and close them unused, which is not an error.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with redirect_stdout(io.StringIO()), own_pages_only():  # viser prints a banner
        server = LocalServer(host=LOCAL_NAMES[0], port=port, verbose=False, label="iowbc")
    try:
        if port and server.get_port() != port:
            raise UsageError(f"port {port} is taken; try another --port")
        check_values(server)
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()
