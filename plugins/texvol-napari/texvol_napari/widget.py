"""Dock widget *Render exactly*: texvol's picture of what napari shows, with its error, to look at and to save."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.qt.threading import thread_worker
from qtpy.QtCore import Qt
from qtpy.QtGui import QImage, QPixmap, QResizeEvent
from qtpy.QtWidgets import (
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from texvol import TexvolError
from texvol_napari.drawing import Drawing, drawn
from texvol_napari.translation import translated

_LEAST, _MOST = 0.1, 32.0  # error, in 255ths
_SMALLEST = 160  # pixels of the picture's place


class RenderExactly(QWidget):
    """Widget that draws the layers of a viewer; napari makes it."""

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.viewer = napari_viewer
        self.drawing: Drawing | None = None
        self._worker: Any = None
        self.error = QDoubleSpinBox()
        self.error.setRange(_LEAST, _MOST)
        self.error.setValue(1.0)
        self.error.setSingleStep(0.5)
        self.error.setToolTip("Largest error of each layer, in 255ths of linear light or of the contrast limits")
        self.render_button = QPushButton("Render exactly")
        self.render_button.clicked.connect(self.render_layers)
        self.save_button = QPushButton("Save PNG …")
        self.save_button.setEnabled(False)
        self.save_button.clicked.connect(self._ask_where)
        self.shown = QLabel()
        self.shown.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.shown.setMinimumSize(_SMALLEST, _SMALLEST)
        self.shown.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Expanding)
        self.report = QLabel("Draws the visible layers as the 3D canvas shows them.")
        self.report.setWordWrap(True)
        self.report.setTextFormat(Qt.TextFormat.PlainText)  # names of layers are the user's
        self.report.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._lay_out()

    def _lay_out(self) -> None:
        form = QFormLayout()
        form.addRow("Error at most, of 255", self.error)
        layout = QVBoxLayout(self)
        layout.addLayout(form)
        for each in (self.render_button, self.shown, self.report, self.save_button):
            layout.addWidget(each)
        layout.setStretchFactor(self.shown, 1)

    def render_layers(self) -> None:
        """Start to draw what the canvas shows; the picture comes when it is ready."""
        try:
            height, width = self.viewer.screenshot(canvas_only=True, flash=False).shape[:2]
            ratio = self.devicePixelRatioF()  # the camera counts pixels of the screen's layout
            logical = (max(round(width / ratio), 1), max(round(height / ratio), 1))
            translation = translated(self.viewer.layers, self.viewer.camera, self.viewer.dims, logical)
        except TexvolError as error:
            self._tell(str(error))
            return
        self.render_button.setEnabled(False)
        self._tell("Drawing …")
        worker = thread_worker(drawn, ignore_errors=True)(translation, (width, height), self.error.value())
        worker.returned.connect(self._take)
        worker.errored.connect(lambda error: self._tell(str(error)))
        worker.finished.connect(lambda: self.render_button.setEnabled(True))
        self._worker = worker
        worker.start()

    def save(self, path: str) -> None:
        """Write the picture, and tell where, or why not."""
        if self.drawing is None:
            return
        try:
            self.drawing.save(path)
        except TexvolError as error:
            self._tell(str(error))
            return
        self._tell("\n".join((*self.drawing.lines, f"saved as {path}")))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the picture to its place."""
        super().resizeEvent(event)
        self._show()

    def _take(self, drawing: Drawing) -> None:
        self.drawing = drawing
        self.save_button.setEnabled(True)
        self._tell("\n".join(drawing.lines))
        self._show()

    def _tell(self, text: str) -> None:
        self.report.setText(text)

    def _show(self) -> None:
        if self.drawing is None:
            return
        pixels = np.ascontiguousarray(self.drawing.pixels)
        height, width = pixels.shape[:2]
        image = QImage(pixels.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        fitted = QPixmap.fromImage(image).scaled(
            self.shown.size(), Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
        )
        self.shown.setPixmap(fitted)

    def _ask_where(self) -> None:
        path, _ = QFileDialog.getSaveFileName(self, "Save the picture", "layers.png", "Pictures (*.png *.jpg)")
        if path:
            self.save(path if path.lower().endswith((".png", ".jpg", ".jpeg")) else f"{path}.png")
