"""Web server of a window: one page and one websocket, on a thread with an event loop of its own.

Who has the token has the window, and with it the files that the window can read and write. So the server listens on
this machine only unless told otherwise, and refuses a request with another token, a websocket of another page
(Origin), and, on this machine, a name of the machine (Host) that a stranger's name server may have made up.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import logging
import secrets
import socket
import threading
from collections import deque
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from texvol.util.errors import InputError, missing_extra
from texvol.util.writing import reason_of
from texvol.window.remote.address import Address, is_loopback
from texvol.window.remote.exchange import Exchange
from texvol.window.remote.viewer import Viewer

MOST_CONNECTIONS = 64  # beside those of viewers
_AT_ONCE = 128  # connections that wait to be accepted, and are accepted together
PATIENCE = 10.0  # seconds until a connection has become a viewer's; no page takes longer
# Seconds of silence after which a viewer is asked whether it is still there; it has half of that to answer. A page says
# something each second, so that a slow link on which the question waits behind a picture is not taken for a dead one.
_HEARTBEAT = 4.0
_MOST_BYTES = 1 << 17  # of a message
BUSY, ENDED, WRONG = 4001, 4002, 4003  # why a websocket was closed; page.js knows them
_PAGE = Path(__file__).parent / "page"


class Server:
    """Server of one window, a context manager; `url` is what is to be opened, and answers after `start`.

    Raises
    ------
    InputError
        If the address cannot be had.
    MissingExtraError
        If aiohttp is not installed.
    """

    def __init__(self, exchange: Exchange, address: Address, token: str, viewers: int = 1) -> None:
        self._exchange, self._token, self._address = exchange, token, address
        self._web = _library()
        self._busy: set[Any] = set()  # protocols of viewers
        self._sockets: set[Any] = set()
        self._newest: deque[Any] = deque()  # protocols of connections that came last
        self._pool = ThreadPoolExecutor(viewers, "texvol viewer")
        self._socket = _listening(address)
        self.url = address.url(self._socket.getsockname()[1], token)
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="texvol server")

    def start(self) -> None:
        """Answer those that have connected, and all others."""
        self._thread.start()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self._exchange.end()
        if self._thread.ident is None:
            self._socket.close()
            self._loop.close()
        else:
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()
        self._pool.shutdown()

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.run_until_complete(_cancelled(asyncio.all_tasks(self._loop)))
            self._loop.close()

    async def _serve(self) -> None:
        server = self._web.Server(self._answer, access_log=None, logger=_quiet())
        listening = await self._loop.create_server(lambda: self._connected(server), sock=self._socket, backlog=_AT_ONCE)
        try:
            await self._stop.wait()
        finally:
            listening.close()
            for each in list(self._sockets):
                with contextlib.suppress(Exception):
                    await asyncio.wait_for(each.close(code=ENDED, message=b"the window is closed"), 1)
            await server.shutdown(1)

    def _connected(self, server: Any) -> Any:
        """Return the protocol of a new connection; if there are too many, the oldest one that is no viewer's ends."""
        protocol = server()
        self._newest.append(protocol)
        if len(self._newest) > MOST_CONNECTIONS:
            self._loop.call_soon(self._end, self._newest.popleft())  # not at once: it may be connected in this step
        self._loop.call_later(PATIENCE, self._end, protocol)
        return protocol

    def _end(self, protocol: Any) -> None:
        """End a connection that is no viewer's, also one that does not read what was sent."""
        transport = protocol.transport
        if protocol not in self._busy and transport is not None:
            protocol.force_close()
            transport.abort()

    async def _answer(self, request: Any) -> Any:
        """Answer a request of any kind and path, and end its connection: answers that nobody reads do not pile up."""
        if not self._is_allowed(request):
            answer = self._refusal(403, "wrong token or origin; open the address that texvol view printed")
        elif request.method != "GET" or request.path not in ("/", "/window"):
            answer = self._refusal(404, "there is nothing here")
        elif request.path == "/window":
            return await self._view(request)
        else:
            answer = self._page()
        answer.force_close()
        return answer

    def _refusal(self, status: int, reason: str) -> Any:
        return self._web.Response(status=status, text=f"texvol: {reason}\n")

    def _is_allowed(self, request: Any) -> bool:
        token = request.query.get("token", "").encode("utf-8", "replace")
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        allowed = hmac.compare_digest(token, self._token.encode())
        with contextlib.suppress(ValueError):
            if self._address.is_loopback:
                allowed &= is_loopback(urlsplit(f"//{host}").hostname or "")
            if request.path != "/" or origin is not None:  # a browser says whose page opens a websocket
                allowed &= origin is not None and urlsplit(origin).netloc == host
            return allowed
        return False

    def _page(self) -> Any:
        nonce = secrets.token_urlsafe(16)
        text = (_PAGE / "page.html").read_text("utf-8")
        for name in ("view.js", "page.js", "page.css"):
            text = text.replace(f"/* {name} */", (_PAGE / name).read_text("utf-8"))
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src blob: data:; "
            "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        headers = {
            "Content-Security-Policy": policy, "Referrer-Policy": "no-referrer", "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY",
        }  # fmt: skip
        return self._web.Response(text=text.replace("NONCE", nonce), content_type="text/html", headers=headers)

    async def _view(self, request: Any) -> Any:
        """Serve a viewer until it leaves or the window is closed."""
        told: dict[str, Any] = {"heartbeat": _HEARTBEAT, "max_msg_size": _MOST_BYTES, "compress": False}
        connection = self._web.WebSocketResponse(**told)
        await connection.prepare(request)
        viewer = Viewer(self._exchange)
        with self._exchange.viewed(viewer) as is_welcome:
            if not is_welcome:
                await connection.close(code=BUSY, message=b"another viewer has this window")
                return connection
            self._busy.add(request.protocol)
            self._sockets.add(connection)
            sending = self._loop.create_task(self._send(viewer, connection))
            try:
                await self._receive(viewer, connection)
            finally:
                self._sockets.discard(connection)
                viewer.leave()
                sending.cancel()
                self._busy.discard(request.protocol)
        return connection

    async def _receive(self, viewer: Viewer, connection: Any) -> None:
        import aiohttp

        async for message in connection:
            try:
                if message.type != aiohttp.WSMsgType.TEXT:
                    raise InputError("a message must be a text")
                viewer.receive(message.data)
            except InputError as error:
                reason = str(error).encode()[:120]  # a reason has room for 123 bytes
                await connection.close(code=WRONG, message=reason.decode("utf-8", "ignore").encode())

    async def _send(self, viewer: Viewer, connection: Any) -> None:
        """Send frames until the viewer or the window has gone."""
        with contextlib.suppress(ConnectionError, RuntimeError):
            while (content := await self._loop.run_in_executor(self._pool, viewer.next)) is not None:
                await connection.send_bytes(content)
            await connection.close(code=ENDED, message=b"the window is closed")


async def _cancelled(tasks: Iterable[Any]) -> None:
    """Cancel the tasks of connections that are still open, and wait for them."""
    for each in tasks:
        each.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _quiet() -> logging.Logger:
    """Return a logger that drops what it is told: anybody can send rubbish, and a terminal is no place for it."""
    logger = logging.getLogger("texvol.server")
    logger.addHandler(logging.NullHandler())
    logger.propagate = False
    return logger


def _library() -> Any:
    try:
        import PIL.Image  # noqa: F401 (packs frames)
        from aiohttp import web
    except ModuleNotFoundError as error:
        raise missing_extra(error.name or "aiohttp", "serve", "texvol view --serve") from error
    return web


def _listening(address: Address) -> socket.socket:
    """Return a socket that listens at the address."""
    ports = [address.port, 0] if address.is_usual else [address.port]
    reason = ""
    for port in ports:
        try:
            return socket.create_server((address.host, port), family=_family(address.host), backlog=_AT_ONCE)
        except OSError as error:
            reason = reason_of(error)
    raise InputError(f"--serve {address.host}:{address.port}: {reason}")


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET
