"""The window in a notebook: frames and events over a process of its own, which ends with the widget."""

from __future__ import annotations

import base64
import io
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import IPython.display
import ipywidgets
import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from PIL import Image
from support.windows import ball, children_of, until

import texvol
from texvol.util.errors import InputError
from texvol.window.remote import notebook


class Cell:
    """A cell that shows a widget: the outputs that IPython is given, and a page that draws each frame."""

    def __init__(self, widget: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.widget, self.cells, self.window = widget, widget.cells, widget.cells.window
        self.outputs: list[dict[str, Any]] = []
        self.updates: list[dict[str, Any]] = []
        monkeypatch.setattr(IPython.display, "display", lambda data, **how: self.outputs.append({"data": data, **how}))
        told = lambda data, **how: self.updates.append({"data": data, **how})  # noqa: E731
        monkeypatch.setattr(IPython.display, "update_display", told)
        self.cells._send = self._take

    def _take(self, _: dict[str, Any], buffers: list[bytes]) -> None:
        self.cells.hear({"drawn": json.loads(buffers[0].partition(b"\n")[0])["frame"]})

    def press(self, *events: dict[str, Any]) -> None:
        for event in events:
            self.cells.hear({"events": [event]})

    def saved(self) -> np.ndarray:
        """Colours of the picture that the notebook holds now."""
        return pixels(self.updates[-1] if self.updates else self.outputs[2])


def pixels(output: dict[str, Any]) -> np.ndarray:
    content = base64.b64decode(output["data"]["image/png"])
    return np.asarray(Image.open(io.BytesIO(content))).astype(int)[..., :3]


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cell]:
    widget = texvol.show(tmp_path / ball(tmp_path, 24), (120, 80), light="none")
    yield Cell(widget, monkeypatch)
    widget.close()


LEFT = {"kind": "button", "name": "left"}


def move(x: int, y: int) -> dict[str, Any]:
    return {"kind": "move", "x": x, "y": y}


def test_a_cell_shows_the_window_and_holds_its_last_picture_for_pages_without_widgets(cell: Cell) -> None:
    cell.widget._ipython_display_()
    style_output, widget_output, picture_output = cell.outputs
    # In a live notebook the second is shown, and its page hides the third.
    assert style_output["data"].keys() == {"text/html", "text/plain"}
    assert widget_output["data"].keys() == {"application/vnd.jupyter.widget-view+json", "text/plain"}
    assert [each["data"]["text/plain"] for each in cell.outputs] == ["", "", repr(cell.widget)]
    assert picture_output["data"].keys() == {"image/png", "text/plain"}
    assert picture_output["metadata"] == {"image/png": {"width": 120}, "texvol": cell.widget.output}
    before = cell.saved()
    assert before.shape == (80, 120, 3)
    cell.cells.hear({"view": True})
    cell.cells.hear({"size": [120, 80, 1]})
    until(lambda: cell.updates and np.abs(cell.saved() - before).max() < 8)  # 8 bits of two error limits, 1/64, 1/255
    assert all(pixels(each)[40, 60].max() > 100 for each in cell.updates)  # none of a window that has no picture yet
    cell.press(move(60, 40), {**LEFT, "down": True}, move(85, 50), LEFT)
    until(lambda: np.abs(cell.saved() - before).max() > 20)
    assert {each["display_id"] for each in (picture_output, *cell.updates)} == {picture_output["display_id"]}
    kept = cell.widget.get_state("picture")["picture"]  # saved with the state of the widgets
    assert base64.b64encode(kept).decode() == cell.updates[-1]["data"]["image/png"]
    process = cell.window._process.pid
    painters = children_of(process)
    assert painters
    cell.widget.close()
    until(lambda: not [each for each in (process, *painters) if Path(f"/proc/{each}").exists()])
    cell.press(move(0, 0))  # dropped


def test_a_box_has_the_pictures_of_its_windows_as_one_arranged_as_in_the_box(tmp_path: Path) -> None:
    path = tmp_path / ball(tmp_path, 16)
    shell = InteractiveShell.instance()
    try:
        windows = [texvol.show(path, size, light="none") for size in ((40, 30), (60, 20), (20, 20))]
        row = ipywidgets.HBox([windows[0], ipywidgets.IntSlider(), windows[1]])
        for box, expected in (
            (ipywidgets.VBox([row, windows[2]]), (30 + 4 + 20, 40 + 4 + 60)),
            (ipywidgets.Tab([windows[0], windows[2]]), (30 + 4 + 20, 40)),
            (ipywidgets.HBox([ipywidgets.Button()]), None),
        ):
            with capture_output() as captured:
                shell.display_formatter.format(box)
            if expected is None:
                assert not captured.outputs, "as without texvol"
                continue
            _, widget, picture = captured.outputs
            assert "application/vnd.jupyter.widget-view+json" in widget.data and not widget.data["text/plain"]
            assert picture.metadata["image/png"] == {"width": expected[1]}
            whole = np.asarray(Image.open(io.BytesIO(base64.b64decode(picture.data["image/png"]))))
            assert whole.shape == (*expected, 4)
            first = np.asarray(Image.open(io.BytesIO(windows[0].last.png)))[..., :3]
            assert np.array_equal(whole[:30, :40, :3], first)
            assert not whole[30:34, :40, 3].any(), "nothing between two"
        windows[2].last.take(windows[0].last.png)
        until(lambda: windows[2].picture == windows[0].picture)
    finally:
        InteractiveShell.clear_instance()


class Fake:
    """A window that notes what it is told."""

    def __init__(self) -> None:
        self.told: list[Any] = []

    def start(self, take: Any) -> None:
        self.told.append("start")

    def send(self, message: Any) -> None:
        self.told.append(message)

    def close(self) -> None:
        self.told.append("close")


def test_a_window_ends_after_the_last_cell_that_shows_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "_LINGER", 0.05)
    window, asked = Fake(), list[Any]()
    told = window.told
    cells = notebook.Cells(window, asked.append, last=None)
    came = ["start", {"begin": True}]  # a page that is loaded again has no frame
    cells.hear({"view": True})
    assert told == came
    cells.hear({"view": True})  # that page, again, or another cell: nobody knows
    cells.hear({"view": False})
    assert (told, asked) == ([*came, *came, {"events": [{"kind": "focus"}]}], [{"ask": True}])
    cells.hear({"view": True})  # the answer of the other cell
    time.sleep(0.2)
    assert "close" not in told
    cells.hear({"view": False})
    until(lambda: told[-1] == "close")


def test_windows_are_counted_and_named(tmp_path: Path) -> None:
    path = tmp_path / ball(tmp_path, 16)
    texts = [repr(texvol.show(each, 64)) for each in (path, np.load(path))]
    number = int(texts[0].partition(":")[0].rpartition(" ")[2])
    assert texts == [
        f"<texvol window {number}: ball.npy, 64 x 64>",
        f"<texvol window {number + 1}: window{number + 1}, 64 x 64>",
    ]


def test_without_interaction_it_is_the_picture_of_render(tmp_path: Path) -> None:
    path = tmp_path / ball(tmp_path, 16)
    how: dict[str, Any] = {"light": "none", "sampling_rate": 2}
    assert np.array_equal(texvol.show(path, 32, interactive=False, **how), texvol.render(path, 32, **how))
    with pytest.raises(InputError, match="sampling_rate is of a picture: give interactive=False with it"):
        texvol.show(path, 32, **how)
