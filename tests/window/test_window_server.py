"""Server of a window under viewers that are silent, slow, many or gone: each loses its place, and leaves nothing."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import closing
from unittest.mock import patch
from urllib.parse import urlsplit

import numpy as np
import pytest
from support.windows import until

from texvol.window.remote import server as servers
from texvol.window.remote.address import Address, address
from texvol.window.remote.exchange import Exchange
from texvol.window.remote.server import MOST_CONNECTIONS, Server

CLOSING = struct.pack("ii", 1, 0)  # with a reset


class Window:
    """Exchange without a window, and its server."""

    def __init__(self) -> None:
        self.exchange = Exchange()
        self.server = Server(self.exchange, Address(port=0), "12345678")
        self.parts = urlsplit(self.server.url)

    def view(self, origin: str = "") -> socket.socket:
        """Connection that asked to become a viewer's."""
        host = self.parts.netloc
        lines = (
            f"GET /window?{self.parts.query} HTTP/1.1", f"Host: {host}", f"Origin: {origin or f'http://{host}'}",
            "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        )  # fmt: skip
        connection = self.connect()
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return connection

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.parts.port or 0), 60)

    def seen(self) -> socket.socket:
        """Viewer's connection, once it is one."""
        found = self.view()
        assert b" 101 " in found.recv(1 << 16)
        until(lambda: self.exchange.watched)
        return found


@pytest.fixture
def window() -> Iterator[Window]:
    made = Window()
    with made.server:
        made.server.start()
        yield made


def masked(text: str) -> bytes:
    """Frame of a websocket with a text, as a client sends it."""
    content = text.encode()
    return bytes([0x81, 0x80 | len(content)]) + bytes(4) + content


def noise(number: int, side: int) -> dict[str, object]:
    """Frame that is large as a JPEG."""
    pixels = np.random.default_rng(number).integers(0, 256, 3 * side * side, np.uint8)
    return {"pixels": pixels.tobytes(), "size": (side, side)}


def test_a_silent_viewer_and_one_that_does_not_read_lose_their_places() -> None:
    with patch.object(servers, "_HEARTBEAT", 0.5):
        made = Window()
        with made.server:
            made.server.start()
            for _ in range(2):  # its frames fill what the connection holds, or there are none
                with closing(made.seen()) as connection:
                    assert made.exchange.watched
                    until(lambda: not made.exchange.watched)
                    connection.settimeout(60)
                    with contextlib.suppress(ConnectionError):
                        while connection.recv(1 << 16):
                            pass
                made.exchange.show(**noise(1, 2048))


def test_viewers_that_go_away_in_the_middle_leave_nothing(window: Window) -> None:
    def left() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), threading.active_count()

    window.seen().close()  # what is made once
    until(lambda: not window.exchange.watched)
    before = left()
    for number in range(50):
        connection = window.view()
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, CLOSING)
        window.exchange.show(**noise(number, 128))
        if number % 2:
            connection.recv(100)
        connection.close()
    until(lambda: not window.exchange.watched and left() == before)
    assert window.exchange.wait(0)[-1].kind == "focus", "what they held is let go of"


def test_more_connections_than_there_may_be_are_refused_at_once() -> None:
    with patch.object(servers, "PATIENCE", 1e6):  # none is ended as idle
        made = Window()
        with made.server, contextlib.ExitStack() as closers:
            made.server.start()
            several = []
            for _ in range(4 * MOST_CONNECTIONS):
                one = closers.enter_context(made.connect())
                one.setblocking(False)
                several.append(one)
            until(lambda: sum(map(is_closed, several)) == 3 * MOST_CONNECTIONS)


def test_half_open_requests_do_not_delay_a_viewer() -> None:
    with patch.object(servers, "PATIENCE", 1e6):
        made = Window()
        with made.server, contextlib.ExitStack() as closers:
            made.server.start()
            for _ in range(300):
                closers.enter_context(made.connect()).sendall(b"GET / HTTP/1.1\r\n")
            with closing(made.seen()) as viewer:
                for _ in range(2 * MOST_CONNECTIONS):  # a viewer does not make room for others
                    closers.enter_context(made.connect())
                made.exchange.show(pixels=bytes(12), size=(2, 2))
                viewer.settimeout(60)
                assert b'"frame": 1' in viewer.recv(1 << 16)


def test_a_connection_ends_with_its_answer_and_with_the_patience_of_the_server() -> None:
    with patch.object(servers, "PATIENCE", 0.5):
        made = Window()
        with made.server:
            made.server.start()
            with closing(made.connect()) as refused:
                refused.sendall(2 * b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
                assert received(refused).count(b"403 Forbidden") == 1
            with closing(made.connect()) as silent:
                assert received(silent) == b""


def received(connection: socket.socket) -> bytes:
    """All that comes until the server ends the connection, by a reset too."""
    content = b""
    with contextlib.suppress(ConnectionError):
        while piece := connection.recv(1 << 16):
            content += piece
    return content


def is_closed(connection: socket.socket) -> bool:
    try:
        return not connection.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


def test_a_second_viewer_is_told_and_the_first_goes_on(window: Window) -> None:
    with closing(window.seen()) as first, closing(window.view()) as second:
        answer = b""
        while piece := second.recv(1 << 10):
            answer += piece
            if b"another viewer" in answer:
                break
        assert b"another viewer has this window" in answer
        window.exchange.show(pixels=bytes(12), size=(2, 2))
        first.settimeout(60)
        assert b'"frame": 1' in first.recv(1 << 16)
        first.sendall(masked(json.dumps({"events": [{"kind": "move", "x": 3}]})))
        until(lambda: [each.x for each in window.exchange.wait(0.1) if each.kind == "move"] == [3.0])


@pytest.mark.parametrize("host", ["127.0.0.2", "LOCALHOST"])
def test_names_of_others_are_refused_at_every_address_of_this_machine(host: str) -> None:
    server = Server(Exchange(), address(f"{host}:0"), "12345678")
    parts = urlsplit(server.url)
    with server:
        server.start()
        for name, expected in ((parts.netloc, b" 200 "), ("texvol.example", b" 403 ")):
            with closing(socket.create_connection((parts.hostname, parts.port), 60)) as connection:
                connection.sendall(f"GET /?{parts.query} HTTP/1.1\r\nHost: {name}\r\n\r\n".encode())
                assert expected in received(connection)


def test_what_is_not_started_is_closed() -> None:
    made = Window()
    with made.server, made.connect():
        pass
    with pytest.raises(ConnectionRefusedError):
        made.connect()
