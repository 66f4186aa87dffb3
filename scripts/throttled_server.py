"""Server of a folder over http that is as slow as a distant one: bytes per second in all, and seconds per request.

    python scripts/throttled_server.py FOLDER [--rate 10e6] [--latency 0.04] [--port 0]

It answers requests for ranges of bytes, and prints its address. It listens on the loopback alone.
"""

from __future__ import annotations

import argparse
import re
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

_PIECE = 1 << 15  # bytes that are sent at once


class ThrottledServer(ThreadingHTTPServer):
    """Files of a folder at a rate that all connections share."""

    daemon_threads = True
    request_queue_size = 64

    def __init__(self, folder: Path, rate: float, latency: float, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.folder, self.rate, self.latency = folder.resolve(), rate, latency
        self.sent, self.requests = 0, 0
        self._free_at, self._lock = 0.0, threading.Lock()

    @property
    def address(self) -> str:
        """URL of the folder."""
        return f"http://127.0.0.1:{self.server_address[1]}"

    def wait_for(self, count: int) -> None:
        """Wait until so many bytes may be sent."""
        with self._lock:
            now = time.monotonic()
            self._free_at = max(self._free_at, now) + count / self.rate
            self.sent += count
            wait = self._free_at - now
        time.sleep(wait)

    def count_request(self) -> None:
        """Wait for as long as a request is on its way."""
        with self._lock:
            self.requests += 1
        time.sleep(self.latency)


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # as servers do: else what follows the header waits for 40 ms more
    server: ThrottledServer

    def do_GET(self) -> None:
        """Send a file, or a range of it."""
        self.server.count_request()
        path = (self.server.folder / unquote(urlsplit(self.path).path).lstrip("/")).resolve()
        if not path.is_relative_to(self.server.folder) or not path.is_file():
            self.send_response(HTTPStatus.NOT_FOUND)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        size = path.stat().st_size
        first, last = _range(self.headers.get("Range", ""), size)
        if first > last and size:
            self.send_response(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
            self.send_header("Content-Range", f"bytes */{size}")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        whole = (first, last) == (0, size - 1)
        self.send_response(HTTPStatus.OK if whole else HTTPStatus.PARTIAL_CONTENT)
        if not whole:
            self.send_header("Content-Range", f"bytes {first}-{last}/{size}")
        self.send_header("Content-Length", str(last - first + 1))
        self.end_headers()
        if self.command == "GET":
            self._send(path, first, last)

    do_HEAD = do_GET

    def _send(self, path: Path, first: int, last: int) -> None:
        with open(path, "rb") as file:
            file.seek(first)
            left = last - first + 1
            while left > 0 and (piece := file.read(min(_PIECE, left))):
                self.server.wait_for(len(piece))
                self.wfile.write(piece)
                left -= len(piece)

    def log_message(self, *_: object) -> None:
        """Log nothing."""


def _range(text: str, size: int) -> tuple[int, int]:
    """Return the first and the last byte of a request's range, or of the whole file."""
    found = re.fullmatch(r"bytes=(\d*)-(\d*)", text.strip())
    if found is None or not (found[1] or found[2]):
        return 0, size - 1
    if not found[1]:
        return max(size - int(found[2]), 0), size - 1
    return int(found[1]), min(int(found[2]) if found[2] else size - 1, size - 1)


def main() -> None:
    """Serve until interrupted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rate", type=float, default=10e6, help="bytes per second (10e6)")
    parser.add_argument("--latency", type=float, default=0.04, help="seconds per request (0.04)")
    parser.add_argument("--port", type=int, default=0, help="0: any that is free")
    arguments = parser.parse_args()
    with ThrottledServer(arguments.folder, arguments.rate, arguments.latency, arguments.port) as server:
        print(server.address, flush=True)
        try:
            server.serve_forever(0.05)
        except KeyboardInterrupt:
            print(f"{server.requests} requests, {server.sent / 1e6:.1f} MB", flush=True)


if __name__ == "__main__":
    main()
