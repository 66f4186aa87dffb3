"""A window that is served, and a page in Chromium that shows it."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np

from support.browser import Browser, Page
from support.windows import started, until


class Served(NamedTuple):
    """Process of `texvol view --serve`, and the address that it printed."""

    process: Any
    url: str

    @property
    def port(self) -> int:
        return urlsplit(self.url).port or 0

    def files(self) -> set[str]:
        """Files that the process has open."""
        return {str(each.resolve()) for each in Path(f"/proc/{self.process.pid}/fd").iterdir()}

    def ask(self, path: str, **headers: str) -> str:
        """Status line, and what follows it, of an answer to a request."""
        told = {"Host": f"127.0.0.1:{self.port}", "Connection": "close"} | headers
        lines = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in told.items())
        with socket.create_connection(("127.0.0.1", self.port), 10) as connection:
            connection.sendall(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
            answer = connection.recv(1 << 16)
        return answer.decode("utf-8", "replace")


@contextmanager
def served(folder: Path, *words: str) -> Iterator[Served]:
    """A window at a free port, ended at the end."""
    process = started(None, folder, *words, "--serve", "127.0.0.1:0")
    try:
        line = process.stdout.readline() if process.stdout else ""
        found = re.search(r"http://\S+", line)
        assert found, (line, process.stderr.read() if process.stderr else "")
        yield Served(process, found[0])
    finally:
        process.kill()
        process.communicate()


def page_of(browser: Browser, folder: Path, url: str, width: int = 600, height: int = 400, loads: str = "") -> Page:
    """A page of the address, in a window of a given size, once an expression is true that tells that it is loaded."""
    empty = folder / "empty.html"
    empty.write_text("<!doctype html>", "utf-8")
    page = Page(browser, empty, width, height)
    page.call("Page.navigate", url=url)
    page.wait_for(loads or f"location.href === {json.dumps(url)} && document.readyState === 'complete'")
    return page


PIXELS = """(() => { const c = document.querySelector('canvas'); const o = new OffscreenCanvas(c.width, c.height)
.getContext('2d'); o.drawImage(c, 0, 0); const d = o.getImageData(0, 0, c.width, c.height).data; let s = '';
for (let i = 0; i < d.length; i += 4) s += String.fromCharCode(d[i], d[i + 1], d[i + 2]);
return [c.width, c.height, btoa(s)]; })()"""


def pixels(page: Page) -> np.ndarray:
    """Colours of the canvas, (height, width, 3) integers."""
    import base64

    width, height, content = page.tell(PIXELS)  # at once: the next frame may have another size
    return np.frombuffer(base64.b64decode(content), np.uint8).reshape(height, width, 3).astype(int)


def shows(page: Page, picture: np.ndarray) -> bool:
    """True if the canvas shows exactly a picture."""
    seen = pixels(page)
    return seen.shape == picture.shape and np.array_equal(seen, picture)


def settled(page: Page) -> np.ndarray:
    """Colours of the canvas once it shows a PNG and no longer changes."""
    last: list[np.ndarray] = [np.zeros(0)]

    def same() -> bool:
        now = pixels(page) if page.tell("document.querySelector('canvas').dataset.type") == "image/png" else np.zeros(1)
        before, last[0] = last[0], now
        return now.ndim == 3 and now.any() and np.array_equal(before, now)

    until(same)
    return last[0]
