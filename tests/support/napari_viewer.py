"""A viewer of napari with the dock widget: prints, as JSON, what the widget says, and its differences from the canvas.

Run as a program, since Qt wants a process of its own: python napari_viewer.py FOLDER.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

PATIENCE = 120  # seconds
_SHOWN = 8  # of 255: darker pixels of both pictures are background


class Bench:
    """Viewer and widget, and what was found of each case."""

    def __init__(self) -> None:
        import napari
        from qtpy.QtWidgets import QApplication
        from texvol_napari.widget import RenderExactly

        self.viewer = napari.Viewer(ndisplay=3)
        self.widget = RenderExactly(self.viewer)
        self.viewer.window.add_dock_widget(self.widget)
        self.application = QApplication.instance()
        self.found: dict[str, dict[str, Any]] = {}

    def wait(self, until: Callable[[], bool] = lambda: False, seconds: float = 0.3) -> None:
        """Handle events until something holds, or for some seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            self.application.processEvents()
            time.sleep(0.01)

    def turn(self) -> None:
        """Look at all layers obliquely."""
        self.viewer.reset_view()
        self.viewer.camera.angles = (10, 35, 60)

    def compare(self, name: str) -> None:
        """Press the button, and note the differences from the canvas, in 255ths, where either is not dark."""
        self.wait()
        shown = self.viewer.screenshot(canvas_only=True, flash=False)[..., :3].astype(int)
        self.widget.drawing = None
        self.widget.render_button.click()
        self.wait(self.widget.render_button.isEnabled, PATIENCE)
        self.found[name] = {"says": self.widget.report.text()}
        if self.widget.drawing is None:
            return
        drawn = self.widget.drawing.pixels.astype(int)
        self.found[name] |= {"mean": _mean(drawn, shown), "shifted": _mean(np.roll(drawn, 1, 1), shown)}
        self.found[name]["lit"] = float((drawn.max(-1) > _SHOWN).mean())


def _mean(first: np.ndarray, second: np.ndarray) -> float:
    shown = np.maximum(first, second).max(-1) > _SHOWN
    return float(np.abs(first - second).max(-1)[shown].mean()) if shown.any() else 0.0


def main(folder: Path) -> None:
    bench = Bench()
    viewer, layers = bench.viewer, bench.viewer.layers
    z, y, x = np.mgrid[-1:1:24j, -1:1:28j, -1:1:32j]
    ball = np.exp(-6 * ((x - 0.2) ** 2 + 2 * (y + 0.1) ** 2 + z**2)).astype(np.float32)
    viewer.add_image(ball, scale=(2, 1, 1), rotate=(10, 20, 30), translate=(100, -50, 20))
    bench.turn()
    bench.compare("scaled and rotated")
    viewer.camera.perspective = 40
    bench.compare("perspective")
    viewer.camera.perspective = 0
    layers[0].gamma, layers[0].contrast_limits, layers[0].opacity = 0.8, (0.2, 0.7), 0.5
    bench.compare("gamma, limits and opacity")
    viewer.dims.ndisplay = 2
    bench.compare("slices")
    viewer.dims.ndisplay = 3
    layers[0].visible = False
    bench.compare("hidden")
    layers.clear()
    viewer.add_image(np.stack([ball, ball[::-1]]), channel_axis=0, colormap=["green", "magenta"])
    bench.turn()
    bench.compare("channels")
    layers.clear()
    viewer.add_image(np.stack([0 * ball, ball[:, ::-1]]))
    viewer.dims.set_current_step(0, 1)
    bench.turn()
    bench.compare("time")
    layers.clear()
    viewer.dims.set_current_step(0, 0)
    viewer.add_labels((ball > 0.3) * 1 + (ball > 0.6) * 1).rendering = "translucent"
    bench.turn()
    bench.compare("labels")
    bench.widget.save(str(folder / "layers.png"))
    bench.found["saved"] = {"says": bench.widget.report.text()}
    viewer.add_image(np.stack([ball] * 3, -1), rgb=True)
    viewer.add_points(np.full((1, 3), 5.0))
    viewer.add_surface((np.eye(3) * 20, np.array([[0, 1, 2]])))
    layers[0].visible = False
    bench.compare("left out")
    layers.clear()
    viewer.add_image(ball[0])
    bench.compare("flat")
    print(json.dumps(bench.found))
    viewer.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
