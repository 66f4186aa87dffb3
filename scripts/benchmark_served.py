"""Frames per second and latency of a window in a browser, through a link with a delay and a rate.

    python scripts/benchmark_served.py VOLUME […options of texvol view] [--seconds 4]

Headless Chromium shows the window at 800×600 and drags the volume by real mouse events, through a proxy that sends each
byte on after a delay and at a rate: it turns for frames per second, and moves for the latency. The latency is the time
from a mouse event to a picture in which the volume has come as far as the mouse had: the volume is moved at an even
speed, and the middle of its light in each drawn frame says where the mouse was when that frame was drawn.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.browser import Browser, Page
from support.served import page_of, served

_SIZE = (800, 600)
_LINKS = {"no delay": (0.0, 0.0), "40 ms": (0.04, 0.0), "2 MB/s": (0.0, 2e6), "40 ms, 2 MB/s": (0.04, 2e6),
          "40 ms, 0.5 MB/s": (0.04, 5e5)}  # fmt: skip
_PIECE, _BUFFER = 1 << 14, 1 << 16  # bytes read at once, and bytes that wait in a router
_SPEED = 150.0  # pixels per second of the mouse
# Notes each drawn frame: its time, its type, and the middle of its light along x.
_WATCH = """(() => { window.seen = []; const canvas = document.querySelector('canvas');
const small = new OffscreenCanvas(160, 30).getContext('2d', {willReadFrequently: true});
new MutationObserver(() => { small.drawImage(canvas, 0, 0, 160, 30);
const data = small.getImageData(0, 0, 160, 30).data; let sum = 0, moment = 0;
for (let i = 0; i < data.length; i += 4) { const light = data[i] + data[i + 1] + data[i + 2];
sum += light; moment += light * (i / 4 % 160 + 0.5); }
window.seen.push([performance.timeOrigin + performance.now(), canvas.dataset.type, moment / sum * canvas.width / 160]);
}).observe(canvas, {attributeFilter: ['data-frame']}); })()"""


class Link:
    """Proxy before a port of this machine, with a `delay` in seconds each way and a `rate` in bytes per second."""

    def __init__(self, port: int, delay: float, rate: float) -> None:
        self._target, self._delay, self._rate = port, delay, rate
        self.sent = 0
        self._loop = asyncio.new_event_loop()
        self._server = self._loop.run_until_complete(asyncio.start_server(self._connect, "127.0.0.1", 0))
        self.port = self._server.sockets[0].getsockname()[1]
        self._runner = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._runner.start()

    def close(self) -> None:
        """End the connections."""

        async def end() -> None:
            self._server.close()
            tasks = asyncio.all_tasks() - {asyncio.current_task()}
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

        asyncio.run_coroutine_threadsafe(end(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._runner.join()
        self._loop.close()

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        theirs = await asyncio.open_connection("127.0.0.1", self._target, limit=_PIECE)
        carried = self._carry(reader, theirs[1]), self._carry(theirs[0], writer)
        with contextlib.suppress(asyncio.CancelledError):  # by close
            await asyncio.gather(*carried, return_exceptions=True)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Read as the rate allows, and write each piece once its delay is over."""
        pieces: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def write() -> None:
            while (piece := await pieces.get())[1]:
                await asyncio.sleep(max(piece[0] - time.monotonic(), 0))
                if not writer.is_closing():
                    writer.write(piece[1])
            writer.close()

        writing, free = asyncio.create_task(write()), 0.0
        while piece := await reader.read(_PIECE):
            now = time.monotonic()
            free = max(free, now) + (len(piece) / self._rate if self._rate else 0.0)
            self.sent += len(piece)
            await pieces.put((free + self._delay, piece))
            await asyncio.sleep(free - now - (_BUFFER / self._rate if self._rate else 0.0))
        await pieces.put((0.0, b""))
        await writing


@contextlib.contextmanager
def shown(browser: Browser, folder: Path, url: str, port: int, link: Link) -> Iterator[Page]:
    """Page that shows the window through a link, at rest."""
    page = page_of(browser, folder, url.replace(f":{port}/", f":{link.port}/"), *_SIZE)
    page.wait_for("document.querySelector('canvas')?.dataset.type === 'image/png'")
    page.tell(_WATCH)
    yield page
    page.close()


def dragged(page: Page, seconds: float, button: str, code: int) -> tuple[list[Any], list[tuple[float, float]]]:
    """Frames that were drawn, and times and places of the mouse, while it goes to and fro."""
    before, middle = "window.seen.splice(0)", (_SIZE[0] / 2, _SIZE[1] / 2)
    page.tell(before)
    page.mouse("mouseMoved", *middle)
    page.mouse("mousePressed", *middle, button=button, buttons=code, clickCount=1)
    places, began = [], time.time()
    while (since := time.time() - began) < seconds:
        way = (since * _SPEED) % 400
        x = middle[0] + (way if way < 100 else 200 - way if way < 300 else way - 400)
        places.append((time.time(), x))
        page.mouse("mouseMoved", x, middle[1], button=button, buttons=code)
        time.sleep(max(1 / 60 - (time.time() - began - since), 0))
    seen = page.tell(before)
    page.mouse("mouseReleased", *middle, button=button, clickCount=1)
    return seen, places


def latency(seen: list[Any], places: list[tuple[float, float]]) -> float:
    """Seconds by which the middle of the light follows the mouse best."""
    times, light = np.array([each[0] / 1000 for each in seen]), np.array([each[2] for each in seen])
    mouse_times, mouse = np.array(places).T
    held = times > times[0] + 1.0
    delays = np.arange(0, 2.0, 0.002)
    rests = [np.std(light[held] - np.interp(times[held] - delay, mouse_times, mouse)) for delay in delays]
    return float(delays[int(np.argmin(rests))])


def main() -> None:
    """Print a line for each link."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("volume", help="file of the volume; options of texvol view may follow")
    arguments, words = parser.parse_known_args()
    words.insert(0, arguments.volume)
    words = [str(Path(each).resolve()) if Path(each).exists() else each for each in words]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        browser = Browser(folder / "profile")
        with served(folder, *words, "--no-panels") as window:
            print(f"{'link':>16} {'frames/s':>9} {'latency, ms':>12} {'kB/frame':>9}")
            for called, (delay, rate) in _LINKS.items():
                link = Link(window.port, delay, rate)
                with shown(browser, folder, window.url, window.port, link) as page:
                    dragged(page, 1.0, "left", 1)
                    sent = link.sent
                    turned, _ = dragged(page, arguments.seconds, "left", 1)
                    size = (link.sent - sent) / max(len(turned), 1) / 1000
                    page.wait_for("document.querySelector('canvas').dataset.type === 'image/png'")
                    moved, places = dragged(page, arguments.seconds, "middle", 4)
                    ms = 1000 * latency(moved, places)
                print(f"{called:>16} {len(turned) / arguments.seconds:9.1f} {ms:12.0f} {size:9.0f}", flush=True)
                link.close()
        browser.close()


if __name__ == "__main__":
    main()
