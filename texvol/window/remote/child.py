"""Process of a window in a notebook: it receives a scene and messages of a viewer, and sends packed frames.

A window has a main loop, and a notebook has another; Dear ImGui has one context at a time, and a kernel shows many
windows. So each has a process of its own, which ends with the connection.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from texvol.util.errors import InputError, TexvolError
from texvol.window.application import Application
from texvol.window.document import Document, Origin
from texvol.window.plan import Plan
from texvol.window.remote.exchange import Exchange
from texvol.window.remote.off_screen import OffScreen
from texvol.window.remote.viewer import Viewer


class Gone(Exception):
    """Nobody is at the other end of the connection."""


def serve(descriptor: int) -> None:
    """Show a window until the connection or the window is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the notebook's own
    connection: Connection = Connection(descriptor)
    with contextlib.suppress(EOFError, OSError, Gone):
        told = connection.recv()
        try:
            _run(connection, told)
        except TexvolError as error:
            connection.send_bytes(b"!" + str(error).encode())
        connection.send_bytes(b"")  # the window is closed


def _run(connection: Connection, told: dict[str, Any]) -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    gone = threading.Event()
    scene, origin = told["scene"], Origin(told["name"])
    backend, device = told["drawn_by"]
    plan = Plan(
        told["size"], open=lambda size: Document(scene.completed(size), origin, size=size), name=told["name"],
        panels=told["panels"], home=partial(OffScreen, exchange, backend, device=device), device=device,
        check=partial(_check, gone),
        shows_empty=False,  # the cell shows the last picture until frames come
    )  # fmt: skip
    with exchange.viewed(viewer):
        threads = [threading.Thread(target=each, args=(connection, viewer, exchange, gone)) for each in (_hear, _tell)]
        threads[0].daemon = True  # it waits for the connection, which the notebook closes
        for each in threads:
            each.start()
        try:
            with Application(plan) as application:
                application.run()
        finally:
            exchange.end()
            threads[1].join()


def _check(gone: threading.Event) -> None:
    if gone.is_set():
        raise Gone


def _hear(connection: Connection, viewer: Viewer, exchange: Exchange, gone: threading.Event) -> None:
    """Take messages until the connection is closed; one that is not valid is left out."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            with contextlib.suppress(InputError):
                viewer.receive(connection.recv_bytes().decode("utf-8", "replace"))
    gone.set()
    exchange.end()
    exchange.wake()


def _tell(connection: Connection, viewer: Viewer, exchange: Exchange, gone: threading.Event) -> None:
    """Send frames until the window is closed."""
    with contextlib.suppress(OSError):
        while (content := viewer.next()) is not None:
            connection.send_bytes(content)
