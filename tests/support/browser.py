"""Headless Chromium with real mouse, touch and keys: its DevTools protocol over two pipes, which nothing else reads."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
# Chromium reads its commands from file 3 and answers on file 4, whatever numbers our ends have.
_START = """import fcntl, os, sys
ends = [fcntl.fcntl(int(each), fcntl.F_DUPFD, 10) for each in sys.argv[1:3]]
for number, end in enumerate(ends, 3): os.dup2(end, number)
os.execvp(sys.argv[3], sys.argv[3:])"""
_PATIENCE = 180  # seconds; a page takes one, and a busy machine many more
_KEYS = {
    "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36, "End": 35, "Tab": 9, "Enter": 13,
}  # fmt: skip
SHIFT = 8


class Browser:
    """One Chromium; its pages come one after the other."""

    def __init__(self, folder: Path) -> None:
        assert CHROMIUM is not None
        their_input, self._write = os.pipe()
        self._read, their_output = os.pipe()
        line = [
            *(sys.executable, "-c", _START, str(their_input), str(their_output), CHROMIUM),
            *("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--no-first-run"),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars"),
            *(f"--user-data-dir={folder}", "about:blank"),
        ]
        environment = os.environ | {"DBUS_SESSION_BUS_ADDRESS": "disabled:"}
        self._process = subprocess.Popen(
            line,
            pass_fds=(their_input, their_output),
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env=environment,
        )
        os.close(their_input)
        os.close(their_output)
        self._number, self._rest = 0, b""
        self.events: list[dict[str, Any]] = []

    def call(self, method: str, session: str | None = None, **parameters: Any) -> dict[str, Any]:
        """What a command answers."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        content = json.dumps(message).encode() + b"\0"
        while content:
            content = content[os.write(self._write, content) :]
        until = time.monotonic() + _PATIENCE
        while True:
            answer = self._next(until)
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return dict(answer["result"])
            self.events.append(answer)

    def _next(self, until: float) -> dict[str, Any]:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], max(until - time.monotonic(), 0))
            content = os.read(self._read, 1 << 20) if ready else b""
            assert content, "Chromium does not answer"
            self._rest += content
        message, self._rest = self._rest.split(b"\0", 1)
        return dict(json.loads(message))

    def close(self) -> None:
        try:
            self.call("Browser.close")
            self._process.wait(_PATIENCE)
        finally:
            self._process.kill()
            self._process.wait()
            os.close(self._write)
            os.close(self._read)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """The one Chromium of the session; a test that asks for it is skipped where there is none."""
    if CHROMIUM is None:
        pytest.skip("no Chromium found")
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


class Page:
    """A page in a window of a given size; what it logged and asked for is kept."""

    def __init__(
        self,
        browser: Browser,
        path: Path,
        width: int = 1280,
        height: int = 900,
        *,
        dark: bool = False,
        fragment: str = "",
    ) -> None:
        self.browser = browser
        browser.events.clear()
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self._target = target
        self._session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.address = path.absolute().as_uri() + fragment
        self.call("Page.navigate", url=self.address)
        self.wait_for("document.readyState === 'complete' && location.protocol === 'file:'")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self.browser.call(method, self._session, **parameters)

    def tell(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait_for(self, expression: str) -> None:
        until = time.monotonic() + _PATIENCE
        while not self.tell(expression):
            assert time.monotonic() < until, f"never came true: {expression}"
            time.sleep(0.02)

    def middle(self, selector: str) -> tuple[float, float]:
        """Where an element is in the window, once it is scrolled to."""
        box = self.tell(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
            "e.scrollIntoView({block: 'nearest'}); const b = e.getBoundingClientRect(); "
            "return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        return box[0], box[1]

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, selector: str) -> None:
        self.drag([self.middle(selector)])

    def drag(self, points: list[tuple[float, float]], between: Callable[[], None] = lambda: None) -> None:
        """Press at the first point, move over the others, call, and release at the last."""
        self.mouse("mouseMoved", *points[0])
        self.mouse("mousePressed", *points[0], button="left", buttons=1, clickCount=1)
        for point in points[1:]:
            self.mouse("mouseMoved", *point, button="left", buttons=1)
        between()
        self.mouse("mouseReleased", *points[-1], button="left", clickCount=1)

    def wheel(self, x: float, y: float, down: float) -> None:
        self.mouse("mouseWheel", x, y, deltaX=0, deltaY=down)

    def key(self, key: str, *, shift: bool = False, between: Callable[[], None] = lambda: None) -> None:
        """Press a key, call, and release it."""
        told: dict[str, Any] = {"key": key, "modifiers": SHIFT if shift else 0}
        if len(key) == 1:
            told["windowsVirtualKeyCode"] = ord(key.upper())
        else:
            told |= {"windowsVirtualKeyCode": _KEYS[key], "code": key}
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown" if text else "rawKeyDown", **told, **text)
        between()
        self.call("Input.dispatchKeyEvent", type="keyUp", **told)

    def touch(self, kind: str, *points: tuple[float, float]) -> None:
        positions = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=positions)

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        content = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(content))

    def complaints(self) -> list[str]:
        """What is in the console, and what was not caught."""
        self.tell("new Promise(done => requestAnimationFrame(() => setTimeout(done)))")
        methods = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
        return [json.dumps(each["params"]) for each in self._events() if each["method"] in methods]

    def requests(self) -> list[str]:
        """Addresses that were asked for besides the page itself and what is inside it."""
        asked = (each for each in self._events() if each["method"] == "Network.requestWillBeSent")
        addresses = (each["params"]["request"]["url"] for each in asked)
        own = self.address.split("#")[0]
        return [each for each in addresses if not each.startswith("data:") and each.split("#")[0] != own]

    def _events(self) -> list[dict[str, Any]]:
        return [each for each in self.browser.events if each.get("sessionId") == self._session]

    def close(self) -> None:
        self.browser.call("Target.closeTarget", targetId=self._target)
