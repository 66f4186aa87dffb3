"""The window in a notebook: frames and events over a process of its own, which ends with the widget."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from support.windows import ball, children_of, until

import texvol
from texvol.util.errors import InputError


def test_a_cell_shows_the_window_and_closing_the_widget_ends_its_processes(tmp_path: Path) -> None:
    frames: list[dict[str, Any]] = []
    widget = texvol.show(tmp_path / ball(tmp_path, 24), (120, 80), light="none")
    cells, window = widget.cells, widget.cells.window

    def take(head: dict[str, Any], buffers: list[bytes]) -> None:
        frames.append(json.loads(buffers[0].partition(b"\n")[0]))
        cells.hear({"drawn": frames[-1]["frame"]})

    def seen() -> np.ndarray:
        bundle = widget._repr_mimebundle_()[0]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(bundle["image/png"])))).astype(int)[..., :3]

    cells._send = take
    before = seen()  # saved where no cell was shown
    assert before.shape == (80, 120, 3)
    cells.hear({"view": True})
    cells.hear({"size": [120, 80, 1]})
    until(lambda: np.abs(seen() - before).max() < 8)  # 8 bits of two error limits, 1/64 and 1/255
    start, end = {"kind": "move", "x": 60, "y": 40}, {"kind": "move", "x": 85, "y": 50}
    button = {"kind": "button", "name": "left"}
    for events in ([start, {**button, "down": True}], [end], [button]):
        cells.hear({"events": events})
    until(lambda: np.abs(seen() - before).max() > 20)
    until(lambda: widget.get_state("picture")["picture"] == window.picture)  # what is saved with the notebook
    process = window._process.pid
    painters = children_of(process)
    assert painters
    widget.close()
    until(lambda: not [each for each in (process, *painters) if Path(f"/proc/{each}").exists()])
    cells.hear({"events": [start]})  # dropped


def test_without_interaction_it_is_the_picture_of_render(tmp_path: Path) -> None:
    path = tmp_path / ball(tmp_path, 16)
    how: dict[str, Any] = {"light": "none", "sampling_rate": 2}
    assert np.array_equal(texvol.show(path, 32, interactive=False, **how), texvol.render(path, 32, **how))
    with pytest.raises(InputError, match="sampling_rate is of a picture: give interactive=False with it"):
        texvol.show(path, 32, **how)
