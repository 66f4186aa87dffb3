"""The window in JupyterLab itself, in Chromium: dragged, saved, and opened again without the kernel."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.browser import Browser, Page
from support.jupyter import Jupyter, command, jupyter, notebook, windows_of
from support.served import settled
from support.windows import ball, until

_SHOW = "texvol.show('ball.npy', (160, 120), light='head')"
_FIRST = "import ipywidgets, texvol; from texvol.window.remote import notebook; notebook._LINGER = 0.1"
_BOX = f"ipywidgets.VBox([ipywidgets.HBox([{_SHOW}, {_SHOW}]), ipywidgets.IntSlider()])"
# The class of each output that is seen, and its text.
_SEEN = """JSON.stringify([...document.querySelectorAll('.jp-OutputArea-child')]
.filter(e => e.getClientRects().length && e.getClientRects()[0].height > 8)
.map(e => [e.querySelector('.texvol-window') ? 'window' : e.querySelector('img') ? 'picture' : 'other',
e.innerText.trim()]))"""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Jupyter]:
    folder = tmp_path_factory.mktemp("notebooks")
    ball(folder, 24)
    with jupyter(folder) as started:
        yield started


def seen(page: Page) -> list[list[str]]:
    return list(json.loads(page.tell(_SEEN)))


def saved_pictures(path: Path) -> list[np.ndarray]:
    """Pictures in a notebook's file."""
    outputs = [each for cell in json.loads(path.read_text())["cells"] for each in cell["outputs"]]
    files = [each["data"]["image/png"] for each in outputs if "image/png" in each["data"]]
    return [np.asarray(Image.open(io.BytesIO(base64.b64decode(each))).convert("RGB")).astype(int) for each in files]


def save(page: Page) -> None:
    page.tell("jupyterapp.commands.execute('docmanager:save').then(() => true)")


def run_all(server: Jupyter, page: Page, windows: int) -> None:
    server.wait_for_kernel()
    command(page, "notebook:run-all-cells")
    page.wait_for(f"document.querySelectorAll('canvas[data-type]').length === {windows}")


@pytest.mark.slow
def test_a_window_is_dragged_and_its_last_picture_is_there_without_the_kernel(
    browser: Browser, server: Jupyter
) -> None:
    path = server.folder / "one.ipynb"
    path.write_text(notebook(_FIRST, _SHOW, _BOX))
    page = server.opened(browser, path.name)
    run_all(server, page, 3)
    assert seen(page) == [["window", ""], ["window", "0"]]
    before, (x, y) = settled(page), page.middle("canvas")
    assert before.shape == (120, 160, 3)
    page.drag([(x, y), (x + 20, y + 10), (x + 50, y + 20)])
    until(lambda: np.abs(settled(page) - before).max() > 20)
    after = settled(page)

    def is_saved() -> bool:
        save(page)
        return any(np.array_equal(each, after) for each in saved_pictures(path)[:1])

    until(is_saved)
    assert saved_pictures(path)[1].shape == (120, 160 + 4 + 160, 3)
    _check_keys(page)
    page.close()
    server.without_kernels()
    until(lambda: not windows_of(server))
    page = server.opened(browser, path.name)
    server.wait_for_kernel()  # another one, that knows no widget
    until(lambda: seen(page) == [["picture", ""], ["picture", ""]])
    path.with_name("other.ipynb").write_text(path.read_text().replace("import ipywidgets", "import  ipywidgets"))
    page.close()
    page = server.opened(browser, "other.ipynb")  # that nobody here has run: it is not trusted
    until(lambda: seen(page) == [["picture", ""], ["picture", ""]])
    page.close()
    server.without_kernels()


def _check_keys(page: Page) -> None:
    """Keys are the window's while it has the focus: no cell comes, goes, or is left by them."""
    cells = "[...document.querySelectorAll('.jp-Cell')].map(e => e.className).join()"
    page.click("canvas")
    before = page.tell(cells)
    for key in [*"abddmyxz", "ArrowDown", "ArrowUp", "Enter"]:
        page.key(key)
    page.key("Enter", shift=True)
    assert page.tell(f"[{cells}, document.activeElement.ariaLabel]") == [before, "keys"]


@pytest.mark.slow
def test_windows_that_are_not_seen_deleted_or_of_a_kernel_that_has_ended_take_no_process(
    browser: Browser, server: Jupyter
) -> None:
    path = server.folder / "many.ipynb"
    path.write_text(
        notebook(_FIRST, *[_SHOW] * 2, "from IPython.display import HTML; HTML('<p style=height:2000px>')", _SHOW)
    )
    page = server.opened(browser, path.name)
    run_all(server, page, 2)
    first = windows_of(server)
    assert len(first) == 2, "the third window is not seen"
    command(page, "notebook:run-all-cells")
    until(lambda: len(windows_of(server)) == 2 and not {*first} & {*windows_of(server)})
    page.wait_for("document.querySelectorAll('canvas[data-type]').length === 2")
    page.click(".jp-Notebook .jp-Cell:nth-child(2) .cm-content")
    command(page, "notebook:delete-cell")
    until(lambda: len(windows_of(server)) == 1)
    (kernel,) = [each["kernel"]["id"] for each in server.ask("GET", "sessions") if each["path"] == path.name]
    server.ask("POST", f"kernels/{kernel}/restart")
    until(lambda: not windows_of(server))
    assert [kind for kind, _ in seen(page)][:1] == ["window"], "with its last picture"
    page.close()
