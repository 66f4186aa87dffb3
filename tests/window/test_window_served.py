"""The window in a browser: seen and steered in headless Chromium, refused to strangers, and gone without a trace."""

from __future__ import annotations

import contextlib
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.browser import Browser, Page
from support.served import Served, page_of, pixels, served, settled, shows
from support.windows import PATIENCE, ball, children_of, texvol, until

from texvol.window.remote.server import MOST_CONNECTIONS

SIZE = (240, 160)
CLOSED = (
    "new Promise(done => {{ const s = new WebSocket('/window' + location.search); {} s.onclose = e => done(e.code); }})"
)


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Served, np.ndarray]]:
    """A window without panels, and the picture that `texvol render` writes of its scene."""
    folder = tmp_path_factory.mktemp("served")
    how = [ball(folder, 24), "--light", "none"]
    texvol(folder, "render", *how, "--size", "240x160", "--max-error", str(1 / 255), "-o", "rest.png")
    rest = np.asarray(Image.open(folder / "rest.png").convert("RGB")).astype(int)
    with served(folder, *how, "--no-panels") as process:
        yield process, rest


@pytest.fixture
def page(browser: Browser, window: tuple[Served, np.ndarray], tmp_path: Path) -> Iterator[Page]:
    opened = page_of(browser, tmp_path, window[0].url, *SIZE)
    opened.wait_for("document.querySelector('canvas')?.dataset.frame > 0")
    yield opened
    opened.close()


def say(page: Page) -> str:
    return str(page.tell("document.getElementById('message').checkVisibility() ? message.innerText : ''"))


def test_the_picture_at_rest_is_that_of_render_and_a_drag_turns(page: Page, window: tuple[Served, np.ndarray]) -> None:
    until(lambda: shows(page, window[1]))
    assert page.tell("document.querySelector('canvas').dataset.type") == "image/png"
    page.drag([(120, 80), (150, 90), (170, 100)])
    until(lambda: np.abs(pixels(page) - window[1]).max() > 20)
    page.key("r")  # the view of `texvol render`
    until(lambda: shows(page, window[1]))
    page.wheel(120, 80, -300)
    until(lambda: np.abs(pixels(page) - window[1]).max() > 20)
    page.key("r")
    until(lambda: shows(page, window[1]))
    assert page.complaints() == []


def test_one_finger_turns_and_two_zoom(page: Page, window: tuple[Served, np.ndarray]) -> None:
    page.key("r")
    until(lambda: shows(page, window[1]))
    page.touch("touchStart", (120, 80))
    for step in range(1, 5):
        page.touch("touchMove", (120 + 10 * step, 80))
    page.touch("touchEnd")
    until(lambda: np.abs(pixels(page) - window[1]).max() > 20)
    turned = settled(page)
    page.touch("touchStart", (110, 80), (130, 80))
    for step in range(1, 5):
        page.touch("touchMove", (110 - 10 * step, 80), (130 + 10 * step, 80))
    page.touch("touchEnd")
    # The ball fills the picture: what is black around it has gone.
    until(lambda: (pixels(page).max(axis=2) < 8).mean() < 0.7 * (turned.max(axis=2) < 8).mean())


def test_a_button_stands_in_for_the_tab_key(page: Page, window: tuple[Served, np.ndarray]) -> None:
    page.key("r")
    until(lambda: shows(page, window[1]))
    hidden = "getComputedStyle(document.getElementById('panels')).display"
    assert page.tell(hidden) == "none", "there is a keyboard"
    page.tell("document.getElementById('panels').click()")
    until(lambda: np.abs(pixels(page) - window[1]).max() > 20)
    page.tell("document.getElementById('panels').click()")
    until(lambda: shows(page, window[1]))


def test_a_page_that_is_loaded_again_and_one_of_another_size_show_the_window(
    browser: Browser, page: Page, window: tuple[Served, np.ndarray], tmp_path: Path
) -> None:
    other = page_of(browser, tmp_path, window[0].url, 200, 150)
    until(lambda: "Another viewer has this window" in say(other))
    page.call("Page.navigate", url="about:blank")
    other.wait_for("document.querySelector('canvas').width === 200 && document.querySelector('canvas').height === 150")
    until(lambda: say(other) == "")
    other.close()


def test_strangers_are_refused(window: tuple[Served, np.ndarray]) -> None:
    process = window[0]
    right, host = process.url[process.url.index("/?") :], f"127.0.0.1:{process.port}"
    socket_path = right.replace("/?", "/window?")
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13",
               "Sec_WebSocket_Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip
    assert " 200 " in process.ask(right).splitlines()[0]
    assert " 101 " in process.ask(socket_path, Origin=f"http://{host}", **upgrade).splitlines()[0]
    refused = [
        process.ask("/"), process.ask("/?token=" + "x" * 32), process.ask(right + "x"),
        process.ask(right, Host="texvol.example"),
        process.ask(right, Origin="http://texvol.example"),
        process.ask(socket_path, **upgrade),
        process.ask(socket_path, Origin="http://texvol.example", **upgrade),
        process.ask(socket_path, Origin="null", **upgrade),
    ]  # fmt: skip
    assert [each.splitlines()[0] for each in refused] == ["HTTP/1.1 403 Forbidden"] * len(refused)
    path = right.replace("/?", "/../../etc/passwd?")
    assert " 404 " in process.ask(path, Origin=f"http://{host}").splitlines()[0]


def test_a_viewer_that_sends_rubbish_is_closed_and_the_window_goes_on(
    browser: Browser, window: tuple[Served, np.ndarray], tmp_path: Path
) -> None:
    page = page_of(browser, tmp_path, window[0].url, *SIZE)
    page.call("Page.navigate", url=window[0].url.replace("/?", "/nothing?"))  # a page without a viewer
    page.wait_for("location.pathname === '/nothing'")
    for rubbish in ("'{'", "'[]'", '\'{"events": [{"kind": "drop", "names": ["/etc/passwd"]}]}\'', "new Uint8Array(9)"):
        assert page.tell(CLOSED.format(f"s.onopen = () => s.send({rubbish});")) == 4003
    page.close()


def test_a_thousand_connections_leave_the_viewer_its_window(page: Page, window: tuple[Served, np.ndarray]) -> None:
    def open_files() -> int:
        return len(list(Path(f"/proc/{window[0].process.pid}/fd").iterdir()))

    before_them = open_files()
    with contextlib.ExitStack() as closers:
        for _ in range(1000):
            one = closers.enter_context(socket.socket())
            one.settimeout(5)
            with contextlib.suppress(OSError):
                one.connect(("127.0.0.1", window[0].port))
        most = open_files()
        # Those that are refused are ended one step of the loop later.
        until(lambda: open_files() <= before_them + MOST_CONNECTIONS)
        assert most > before_them
        page.key("r")
        until(lambda: shows(page, window[1]))
        page.wheel(120, 80, 200)
        until(lambda: np.abs(pixels(page) - window[1]).max() > 20)


def test_ctrl_c_leaves_no_process_and_tells_the_viewer(browser: Browser, tmp_path: Path) -> None:
    with served(tmp_path, "--no-panels", "--backend", "osmesa", "--token", "12345678") as process:
        assert process.url.endswith("/?token=12345678")
        page = page_of(browser, tmp_path, process.url, *SIZE)
        page.wait_for("document.querySelector('canvas')?.dataset.frame > 0")
        started = children_of(process.process.pid)
        assert len(started) == 2  # painters
        process.process.send_signal(signal.SIGINT)
        assert process.process.wait(PATIENCE) == 130
        assert not [each for each in started if Path(f"/proc/{each}").exists()]
        until(lambda: say(page) == "The window is closed.")
        page.close()


def test_a_volume_that_cannot_be_read_is_refused_before_an_address_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from texvol.__main__ import main

    (tmp_path / "broken.nrrd").write_text("hello")
    with contextlib.chdir(tmp_path):
        assert main(["view", "broken.nrrd", "--serve", "127.0.0.1:0"]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err == "texvol: error: broken.nrrd: named NRRD, but its content is text\n"


@pytest.mark.parametrize(
    "words, reason",
    [
        (["--serve", "somewhere:x"], "--serve must be HOST:PORT, such as 127.0.0.1:8765, got 'somewhere:x'"),
        (["--serve", "127.0.0.1:70000"], "--serve must be HOST:PORT, such as 127.0.0.1:8765, got '127.0.0.1:70000'"),
        (["--serve", "--token", "short"], "--token must be at least 8 letters, digits, - or _, got 'short'"),
        (["--serve", "--files", "nowhere"], "--files must be a folder, got 'nowhere'"),
        (["--files", "."], "--files is of a window in a browser: give --serve with it"),
        (["--viewers", "2"], "--viewers is of a window in a browser: give --serve with it"),
    ],
)
def test_wrong_options_are_one_line(words: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    from texvol.__main__ import main

    assert main(["view", "ball.npy", *words]) == 2
    assert capsys.readouterr().err == f"texvol: error: {reason}\n"
