"""A served report, and requests of any kind to it."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from texvol.comparison.runs.stored import Run
from texvol.pytest_plugin.serving import Server


@contextmanager
def serving(report: Path, root: Path) -> Iterator[Server]:
    """Serve a report from a thread."""
    with Server(Run.read(report), root) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def asked(server: Server, method: str, path: str, body: object = None, **headers: str) -> tuple[int, bytes]:
    """Status and content of a request; headers without a value are those of the page."""
    host = f"127.0.0.1:{server.server_port}"
    usual: Mapping[str, str] = {"Host": host, "Origin": f"http://{host}", "Content-Type": "application/json"}
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    try:
        told = {**usual, **{name.replace("_", "-"): text for name, text in headers.items()}}
        connection.request(method, path, None if body is None else json.dumps(body).encode(), told)
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()
