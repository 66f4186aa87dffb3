"""Last picture of windows, as an output of the cells that show them.

The output of a widget only names a model. A notebook that is opened without a kernel has that model if the state of its
widgets was saved, and pages that run no scripts show no widget at all. So a cell has three outputs: a style that hides
the second one where it holds no window, the widget, and the picture, image/png, which is updated in place. Where the
widget shows a picture its page hides the third one, see page/widget.js.
"""

from __future__ import annotations

import base64
import threading
import uuid
from collections.abc import Callable
from typing import Any, NamedTuple

_CALM = 0.3  # seconds without another picture, after which one is put into the notebook

# JupyterLab says "model not found" where the state of widgets was not saved. Pages that drop a style also know no
# widgets, or show the text of an output that is not trusted, which is empty.
_HIDING = """<div class="texvol-style"><style>
.jp-OutputArea-child:has(.texvol-style),
.jp-OutputArea-child:has(.texvol-style) + .jp-OutputArea-child:not(:has(.texvol-window)),
.output_area:has(.texvol-style),
.output_area:has(.texvol-style) + .output_area:not(:has(.texvol-window)) { display: none; }
</style></div>"""


class Shot(NamedTuple):
    """A PNG, and its width in pixels of the page: a screen of high resolution has more of its own."""

    png: bytes
    width: int


class Output:
    """Outputs of the cells that show a widget; `text` is for pages that show no pictures, `shot` gives the picture."""

    def __init__(self, text: str, shot: Callable[[], Shot]) -> None:
        self.name = uuid.uuid4().hex  # by which the picture is found
        self._text, self._shot = text, shot

    def display(self, bundle: Any) -> None:
        """Add outputs to the cell that is run; the bundle, with metadata or without, is the widget's."""
        from IPython.display import display

        display({"text/html": _HIDING, "text/plain": ""}, raw=True)
        content = bundle[0] if isinstance(bundle, tuple) else bundle
        display(content | {"text/plain": ""}, raw=True)
        data, how = self._told(self._shot())
        display(data, **how)

    def update(self) -> Shot:
        """Replace the picture, and return it."""
        from IPython.display import update_display

        shot = self._shot()
        data, how = self._told(shot)
        update_display(data, **how)
        return shot

    def _told(self, shot: Shot) -> tuple[dict[str, str], dict[str, Any]]:
        data = {"image/png": base64.b64encode(shot.png).decode("ascii"), "text/plain": self._text}
        metadata = {"image/png": {"width": shot.width}, "texvol": self.name}
        return data, {"display_id": self.name, "raw": True, "metadata": metadata}


class LastPicture:
    """Newest PNG of a window at rest.

    Attributes
    ----------
    width : int
        Of the window, in pixels of the page.
    put : list of functions
        Called when another picture has come and the window rests.
    """

    def __init__(self, width: int, first: Callable[[], bytes]) -> None:
        self.width = width
        self.put: list[Callable[[], object]] = []
        self._png, self._first = b"", first
        self._timer: threading.Timer | None = None

    @property
    def png(self) -> bytes:
        """The PNG; `first` draws it if the window has shown none yet."""
        if not self._png:
            self._png = self._first()
        return self._png

    @property
    def scale(self) -> float:
        """Pixels of the PNG per pixel of the page, at least 1: a narrow page shows a smaller window."""
        return max(int.from_bytes(self.png[16:20], "big") / self.width, 1.0)  # the width is in the first chunk, IHDR

    def take(self, png: bytes) -> None:
        """Put a picture into the notebook, unless another one comes at once."""
        if png == self._png:
            return
        self._png = png
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(_CALM, self._put)
        self._timer.daemon = True
        self._timer.start()

    def _put(self) -> None:
        for each in list(self.put):
            each()
