"""Server of a report, on this machine only, whose page has a button that accepts the chosen pictures.

It listens on the loopback. Every address begins with a random token, which only the user is told; the name of the host
must be the loopback's, so that no other name can be made to lead here, and what accepts must come from the page itself
(Origin). Files are those of the report's folder.
"""

from __future__ import annotations

import hmac
import json
import mimetypes
import secrets
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from texvol.comparison.runs.stored import INDEX, MARK, Run
from texvol.pytest_plugin.accepting import accept, chosen, offers_of
from texvol.util.errors import InputError

_HOSTS = ("127.0.0.1", "localhost")
_ACTION = "accept"
_MOST_BYTES = 1 << 20  # of a request's body
_SECONDS = 10  # that a client may keep a connection without a word
_KINDS = (".html", ".exr", ".json", ".md", ".xml")
# The page as a file may ask for nothing; the served page may ask this server.
_POLICY = (b"script-src 'unsafe-inline';", b"script-src 'unsafe-inline'; connect-src 'self';")
_SERVED = (b"<head>", b'<head>\n<meta name="texvol-accept" content="accept">')


class Server(ThreadingHTTPServer):
    """Server of one report's folder; `tell` is called with a line for each accepted picture."""

    daemon_threads = True

    def __init__(self, run: Run, root: Path, port: int = 0, tell: Callable[[str], object] = lambda line: None) -> None:
        self.run, self.root, self.tell = run, root, tell
        self.token = secrets.token_urlsafe(24)
        self.accepted: list[str] = []
        self._lock = threading.Lock()
        try:
            super().__init__((_HOSTS[0], port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"--port {port}: cannot be listened on: {getattr(error, 'strerror', error)}") from None

    @property
    def address(self) -> str:
        """Address of the report's page."""
        return f"http://{_HOSTS[0]}:{self.server_port}/{self.token}/{INDEX}"

    @property
    def hosts(self) -> tuple[str, ...]:
        return tuple(f"{host}:{self.server_port}" for host in _HOSTS)

    def accept(self, wanted: list[str]) -> list[str]:
        """Accept pictures by their ids, one request at a time."""
        with self._lock:
            lines = accept(chosen(offers_of(self.run), wanted), self.root)
            self.accepted += lines
            for line in lines:
                self.tell(line)
            return lines


class _Handler(BaseHTTPRequestHandler):
    server: Server
    timeout = _SECONDS
    server_version, sys_version = "texvol", ""

    def do_GET(self) -> None:
        name = self._name()
        if name is None:
            return
        path = self.server.run.path(name)
        if path is None or path.suffix not in _KINDS:
            self._refuse(404, "no such file in the report")
            return
        content = path.read_bytes()
        if name == INDEX and content.endswith(MARK):
            content = content.replace(*_POLICY, 1).replace(*_SERVED, 1)
        self._answer(200, content, mimetypes.guess_type(path.name)[0] or "application/octet-stream")

    def do_POST(self) -> None:
        name = self._name()
        if name is None:
            return
        if self.headers.get("Origin") not in [f"http://{host}" for host in self.server.hosts]:
            self._refuse(403, "the request must come from the report's page")
            return
        if name != _ACTION:
            self._refuse(404, "no such action")
            return
        try:
            lines = self.server.accept(self._wanted())
        except InputError as error:
            self._refuse(400, str(error))
            return
        self._answer(200, json.dumps({"accepted": lines}).encode(), "application/json")

    def _name(self) -> str | None:
        """Return the path after the token; None, and an answer, if host or token are wrong."""
        if self.headers.get("Host") not in self.server.hosts:
            self._refuse(403, "the host must be this machine's loopback")
            return None
        _, _, rest = unquote(urlsplit(self.path).path).partition("/")
        token, _, name = rest.partition("/")
        if not hmac.compare_digest(token.encode(errors="replace"), self.server.token.encode()):
            self._refuse(403, "the token is wrong: use the address that texvol accept printed")
            return None
        return name or INDEX

    def _wanted(self) -> list[str]:
        """Return the ids of the request's body, {"pictures": […]}."""
        length = self.headers.get("Content-Length", "")
        is_json = self.headers.get_content_type() == "application/json"
        if not is_json or not length.isdecimal() or int(length) > _MOST_BYTES:
            raise InputError("the body must be JSON of at most a megabyte")
        try:
            content = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            raise InputError("the body must be JSON") from None
        wanted = content.get("pictures") if isinstance(content, dict) else None
        if not isinstance(wanted, list) or not wanted or not all(isinstance(each, str) for each in wanted):
            raise InputError("pictures must be a list of names")
        return wanted

    def _refuse(self, status: int, reason: str) -> None:
        self.close_connection = True
        self._answer(status, json.dumps({"error": reason}).encode(), "application/json")

    def _answer(self, status: int, content: bytes, kind: str) -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(content)), "Cache-Control": "no-store"}
        headers |= {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
        for name, text in headers.items():
            self.send_header(name, text)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Keep requests off the terminal."""
