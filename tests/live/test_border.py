"""The viewer's border: pages from elsewhere are refused, and whatever a page sends, the server and the others go on."""

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import msgspec.msgpack
import numpy as np
import pytest
import viser
import websockets.asyncio.server
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from iowbc.commands.options import HOST
from iowbc.live import server as border
from iowbc.live.drag import STIFFNESS
from iowbc.live.page import SETTLED, Page
from iowbc.live.server import serving

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
HANDSHAKE = (
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)


def status(port: int, headers: str) -> int:
    """The answer to a request with these headers."""
    with socket.create_connection((HOST, port), timeout=10.0) as raw:
        raw.sendall(f"GET / HTTP/1.1\r\n{headers}\r\n".encode())
        return int(raw.makefile("rb").readline().split()[1])


@pytest.mark.parametrize(
    ("headers", "expected"),
    [
        ("Host: 127.0.0.1:PORT\r\n", 200),
        ("Host: localhost:PORT\r\n", 200),
        ("Host: [::1]:PORT\r\n", 200),
        ("Host: localhost:9999\r\n", 200),
        ("Host: evil.example\r\n", 403),
        ("Host: evil.example:PORT\r\n", 403),
        ("Host: 127.0.0.1.evil.example\r\n", 403),
        ("Host: [\r\n", 403),
        ("", 403),
        ("Host: 127.0.0.1:PORT\r\nHost: evil.example\r\n", 403),
        ("Host: 127.0.0.1:PORT\r\nOrigin: http://127.0.0.1:PORT\r\n" + HANDSHAKE, 101),
        ("Host: 127.0.0.1:PORT\r\nOrigin: https://evil.example\r\n" + HANDSHAKE, 403),
        ("Host: 127.0.0.1:PORT\r\nOrigin: http://127.0.0.1:3000\r\n" + HANDSHAKE, 403),
        ("Host: 127.0.0.1:PORT\r\nOrigin: null\r\n" + HANDSHAKE, 403),
        ("Host: evil.example\r\nOrigin: http://evil.example\r\n" + HANDSHAKE, 403),
    ],
)
def test_only_the_page_of_this_machine_is_answered(headers: str, expected: int) -> None:
    with serving(0) as server:
        port = server.get_port()
        assert status(port, headers.replace("PORT", str(port))) == expected


def test_the_page_cannot_be_framed_by_another() -> None:
    with serving(0) as server, socket.create_connection((HOST, server.get_port()), timeout=10.0) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        head = raw.makefile("rb")
        assert b"Content-Security-Policy: frame-ancestors 'none'\r\n" in iter(head.readline, b"\r\n")


def test_a_library_that_serves_in_another_way_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RuntimeError, match="cannot be watched"), border.own_pages_only():
        pass
    serve = websockets.asyncio.server.serve
    with serving(0):
        assert websockets.asyncio.server.serve is serve


def visitor(page: Page) -> ClientConnection:
    address = f"{HOST}:{page.server.get_port()}"
    return connect(f"ws://{address}", subprotocols=[PROTOCOL], origin=f"http://{address}", max_size=None)  # type: ignore[arg-type]


def say(client: ClientConnection, **message: Any) -> None:
    client.send(msgspec.msgpack.encode(message))


def update(client: ClientConnection, control: Any, **updates: Any) -> None:
    say(client, type="GuiUpdateMessage", uuid=control._impl.uuid, updates=updates)


def turned(page: Page, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not until():
        page.turn(time.monotonic())
        time.sleep(0.01)


HOSTILE = (
    0,
    -1,
    0.0,
    -5,
    1e9,
    1e300,
    -1e300,
    2**63,
    float("nan"),
    float("inf"),
    "x",
    "",
    None,
    [],
    {},
    [1.0],
    True,
    b"x",
)


def test_no_value_from_a_browser_ends_the_server_or_leaves_its_controls_range(page: Page) -> None:
    panel = page.panel
    numbers = [panel.speed, panel.time, panel.impulse, panel.mass, panel.partner_share, panel.seed, *panel._command]
    names = [panel.showing, panel.scene, panel.direction]
    with visitor(page) as client, visitor(page) as other:
        for value in HOSTILE:
            for control in [*numbers, *names, panel.disturbances, *panel._shown.values(), panel._pause]:
                update(client, control, value=value)
            turned(page, 0.05)
        turned(page, 2.0 * SETTLED)
        update(client, panel.speed, value=0.5)
        turned(page, 60.0, until=lambda: bool(panel.speed.value == 0.5))
        assert panel.speed.value == 0.5
        for control in numbers:
            assert (control.min, control.max) == (control.min, control.max)
            assert control.min <= control.value <= control.max
        for control in names:
            assert control.value in control.options
        assert isinstance(panel.disturbances.value, bool)
        update(other, panel.speed, value=0.7)
        turned(page, 60.0, until=lambda: bool(panel.speed.value == 0.7))
        assert panel.speed.value == 0.7


def test_a_browser_changes_values_and_nothing_else_of_a_control(page: Page) -> None:
    speed = page.panel.speed
    with visitor(page) as client:
        update(client, speed, removed=True)
        update(client, speed, value=0.4, max=1e9)
        turned(page, 60.0, until=lambda: bool(speed.value == 0.4))
    assert (speed.value, speed.max, speed._impl.removed) == (0.4, 1.0, False)


def test_other_messages_of_a_browser_keep_nothing_and_end_nothing(page: Page) -> None:
    panel = page.panel
    upload = {"source_component_uuid": panel.speed._impl.uuid, "transfer_uuid": "t"}
    with visitor(page) as client:
        say(client, type="FileTransferStartUpload", filename="x", mime_type="x", part_count=9, size_bytes=9, **upload)
        say(client, type="FileTransferPart", part_index=0, content=b"x" * 500_000, **upload)
        say(client, type="ShareUrlRequest")
        update(client, panel.speed, value=0.3)
        turned(page, 60.0, until=lambda: bool(panel.speed.value == 0.3))
        assert page.server.gui._current_file_upload_states == {}
    for junk in (b"", b"\xff", msgspec.msgpack.encode({"type": "Nothing"}), b"x" * (border.LARGEST_MESSAGE + 1)):
        with visitor(page) as client:
            client.send(junk)
            with suppress(ConnectionClosed):
                for _ in client:
                    """What the server had sent before."""
            assert client.close_code is not None
    with visitor(page) as client:
        update(client, panel.speed, value=0.6)
        turned(page, 60.0, until=lambda: bool(panel.speed.value == 0.6))
    assert panel.speed.value == 0.6


LOOKING = {"wxyz": (1, 0, 0, 0), "position": (0, -3, 2), "look_at": (0, 0, 0), "up_direction": (0, 0, 1), "fov": 1.0}
LOOKING |= {"near": 0.1, "far": 100.0, "image_height": 100, "image_width": 100}
HELD = (0.1, 0.0, 0.8)


def drag(client: ClientConnection, phase: str, end: Any, start: Any = HELD, body: str = "pelvis") -> None:
    say(
        client,
        type="SceneNodeDragMessage",
        name=f"/world/bodies/{body}/looks0",
        phase=phase,
        instance_index=None,
        button="left",
        modifier=None,
        owner="",
        start_position=start,
        start_screen_pos=(0, 0),
        end_position=end,
        end_screen_pos=(0, 0),
    )


def test_what_a_mouse_drags_is_pulled_until_it_lets_go_or_its_browser_disconnects(page: Page) -> None:
    turned(page, 0.1)
    with visitor(page) as client:
        say(client, type="ViewerCameraMessage", **LOOKING)
        for ending in ("end", "disconnect"):
            drag(client, "start", HELD)
            drag(client, "update", (0.1, 0.2, 0.8))
            turned(page, 60.0, until=lambda: bool(page.session.pull["robot"].any()))
            assert page.session.pull["robot"] == pytest.approx([0.0, STIFFNESS * 0.2, 0.0], abs=1e-6)
            assert not page.session.pull["object"].any()
            drag(client, "end", (0.1, 0.2, 0.8)) if ending == "end" else client.close()
            turned(page, 60.0, until=lambda: not page.session.pull["robot"].any())
            assert not page.session.pull["robot"].any()


@pytest.mark.parametrize("place", [(float("nan"), 0, 0), (0, float("-inf"), 0), (1e300, 0, 0)])
def test_a_drag_to_nowhere_is_no_force_and_the_next_one_is(page: Page, place: Any) -> None:
    turned(page, 0.1)
    with visitor(page) as client:
        say(client, type="ViewerCameraMessage", **LOOKING)
        drag(client, "start", HELD)
        drag(client, "update", place)
        drag(client, "update", HELD, start=place)
        update(client, page.panel.speed, value=0.4)
        turned(page, 60.0, until=lambda: bool(page.panel.speed.value == 0.4))
        assert page.drawing.drags.now(np.zeros(3)) == []
        drag(client, "update", (0.1, 0.2, 0.8))
        turned(page, 60.0, until=lambda: bool(page.session.pull["robot"].any()))
        assert np.linalg.norm(page.session.pull["robot"]) == pytest.approx(30.0)


@pytest.mark.parametrize("place", [(0.1, 0.2), "xyz", None, [[1.0]] * 3])
def test_who_drags_to_no_point_at_all_is_cut_off_and_the_others_go_on(page: Page, place: Any) -> None:
    turned(page, 0.1)
    with suppress(ConnectionClosed), visitor(page) as client:
        say(client, type="ViewerCameraMessage", **LOOKING)
        drag(client, "start", HELD)
        drag(client, "update", place)
        for _ in client:
            """What the server had sent before."""
    turned(page, 60.0, until=lambda: not page.drawing.drags.now(np.zeros(3)))
    assert page.drawing.drags.now(np.zeros(3)) == []
    with visitor(page) as client:
        update(client, page.panel.speed, value=0.6)
        turned(page, 60.0, until=lambda: bool(page.panel.speed.value == 0.6))
    assert page.panel.speed.value == 0.6


def test_no_more_pages_are_opened_than_can_be_served(page: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(border, "MOST_CONNECTIONS", 2)
    with visitor(page), visitor(page) as second:
        with pytest.raises(InvalidStatus, match="503"):
            visitor(page)
        second.close()
        with visitor(page):
            pass
