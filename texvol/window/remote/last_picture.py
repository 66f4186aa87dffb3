"""Last picture of a window, as an output of the cells that show it.

The output of a widget only names a model. A notebook that is opened without a kernel has that model if the state of its
widgets was saved, and pages that run no scripts show no widget at all. So a cell has a second output, image/png, which
is updated in place. Where the widget shows a picture its page hides the second output, see page/widget.js.
"""

from __future__ import annotations

import base64
import threading
import uuid
from collections.abc import Callable

_CALM = 0.3  # seconds without another picture, after which one is put into the notebook


class LastPicture:
    """PNG of a window at rest, and the outputs that show it; `keep` is called with each one that is put there.

    `width` is that of the output, in pixels of the page: a screen of high resolution has more of its own.
    """

    def __init__(self, width: int, keep: Callable[[bytes], None]) -> None:
        self.png = b""
        self.output = uuid.uuid4().hex  # name by which the outputs are found
        self._keep, self._metadata = keep, {"image/png": {"width": width}, "texvol": self.output}
        self._is_displayed = False
        self._timer: threading.Timer | None = None

    def take(self, png: bytes) -> None:
        """Put a picture into the notebook, unless another one comes at once."""
        if png == self.png:
            return
        self.png = png
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(_CALM, self._put)
        self._timer.daemon = True
        self._timer.start()

    def display(self, first: Callable[[], bytes]) -> None:
        """Add an output to the cell that is run; `first` draws the picture if the window has shown none yet."""
        from IPython.display import display

        if not self.png:
            self.png = first()
        self._keep(self.png)
        display(self._content(), metadata=self._metadata, raw=True, display_id=self.output)
        self._is_displayed = True

    def _put(self) -> None:
        from IPython.display import update_display

        if self._is_displayed:
            update_display(self._content(), metadata=self._metadata, raw=True, display_id=self.output)
        self._keep(self.png)

    def _content(self) -> dict[str, str]:
        return {"image/png": base64.b64encode(self.png).decode("ascii"), "text/plain": "last picture"}
