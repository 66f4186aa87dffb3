"""`texvol.show`: the window in a cell of a notebook, or a picture."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import subprocess
import sys
import threading
from functools import cache
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

from texvol.output.one_picture import ACCURACY, render, scene_of
from texvol.rendering.picture import Picture
from texvol.scene.scene import Scene
from texvol.util.errors import InputError, missing_extra
from texvol.util.package import environment_of_child
from texvol.window.remote import boxes
from texvol.window.remote.last_picture import LastPicture, Output, Shot
from texvol.window.remote.viewer import Pieces
from texvol.window.stand_in import with_stand_ins

_PATIENCE = 2.0  # seconds to wait for the end of a process that was told to end
_LINGER = 10.0  # seconds that a window stays when no cell shows it: a notebook that is reloaded shows it again
_PAGE = Path(__file__).parent / "page"


def show(
    what: Any,
    size: Any = None,
    *,
    interactive: bool = True,
    panels: bool = False,
    backend: str = "auto",
    device: int | str | None = None,
    **how: Any,
) -> Any:
    """Return a widget that shows the window of `texvol view` in a notebook, or a picture.

    Parameters
    ----------
    what : Scene, Volume, path, array, or image of xarray, nibabel, SimpleITK, pyvista or VTK
    size : (width, height) or int, optional
        Pixels of the page; that of the scene file or 512 x 512 by default.
    interactive : bool
        False: return the picture that `texvol.render` returns.
    panels : bool
        True: show the panels beside the picture, as the key tab does.
    backend : "auto", "egl" or "osmesa"
    device : int or str, optional
        As for `Renderer`.
    how
        As of `texvol.render`; accuracy, such as `max_error`, is of a picture only.

    Raises
    ------
    InputError
        In the cases in which `texvol.render` raises it.
    MissingExtraError
        If the widget needs a library that is not installed.
    """
    if not interactive:
        return render(what, size, backend=backend, device=device, **how)
    if accuracy := set(ACCURACY) & set(how):
        raise InputError(f"{min(accuracy)} is of a picture: give interactive=False with it")
    _check_libraries()  # before anything is read
    scene, pixels, _ = scene_of(what, size, **how)
    name = os.path.abspath(what) if isinstance(what, str | os.PathLike) else scene.volume.name
    boxes.teach(lambda each: isinstance(each, _widget_class()))
    return _widget_class()(Window(with_stand_ins(scene), pixels, name, panels=panels, drawn_by=(backend, device)))


class Window:
    """Process of one window; it is started by `start`, and ends with `close`, or when nobody holds this object.

    `drawn_by` are back end and device. `name` is a path or that of a volume; windows of volumes without a name have
    their number in the kernel in it.
    """

    _numbers = itertools.count(1)

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        name: str,
        *,
        panels: bool,
        drawn_by: tuple[str, int | str | None] = ("auto", None),
    ) -> None:
        self.scene, self.size, self.drawn_by = scene, size, drawn_by
        self.number = next(self._numbers)
        name = f"window{self.number}" if name in ("", "volume") else name  # files of two windows have two names
        self.title = f"texvol window {self.number}: {os.path.basename(name)}"
        self._told: dict[str, Any] = {"scene": scene, "size": size, "name": name, "panels": panels}
        self._told["drawn_by"] = drawn_by
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None

    def start(self, take: Any) -> None:
        """Start the process; `take` is called with each packed frame, on another thread."""
        if self._process is not None and self._process.poll() is None:
            return
        self._connection, theirs = Pipe()
        with theirs:
            code = f"from texvol.window.remote import child; child.serve({theirs.fileno()})"
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", code], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                env=environment_of_child(), pass_fds=(theirs.fileno(),),
            )  # fmt: skip
        self._connection.send(self._told)
        told: tuple[Any, ...] = (self._connection, take)
        threading.Thread(target=self._listen, args=told, daemon=True, name="texvol window").start()

    def send(self, message: dict[str, Any]) -> None:
        """Send a message of the viewer; one to a window that is closed is dropped."""
        with contextlib.suppress(OSError):
            if self._connection is not None:
                self._connection.send_bytes(json.dumps(message).encode())

    def close(self) -> None:
        """End the process."""
        process, self._process, self._connection = self._process, None, None  # the listener closes the connection
        if process is not None:
            process.terminate()
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(_PATIENCE)

    def _listen(self, connection: Connection, take: Any) -> None:
        with contextlib.suppress(EOFError, OSError), connection:
            while content := connection.recv_bytes():
                take(content)


class Cells:
    """Cells that show one window, which starts with the first and ends after the last.

    `send` is the widget's. A page that is closed or loaded again takes its views away without a word, so views are not
    counted: when one leaves the others are asked, and answer as if they had just come.
    """

    def __init__(self, window: Window, send: Any, last: LastPicture) -> None:
        self.window, self._send, self._last = window, send, last
        self._pieces = Pieces()
        self._end = threading.Timer(0, self.window.close)

    def hear(self, message: Any) -> None:
        """Take a message of a cell."""
        if not isinstance(message, dict):
            return
        if "view" not in message:
            self.window.send(message)
        elif message["view"]:
            self._end.cancel()
            self.window.start(self._tell)
            self.window.send({"begin": True})
        else:
            self.window.send({"events": [{"kind": "focus"}]})  # it was lost: nothing is held any more
            self._end.cancel()
            self._end = threading.Timer(_LINGER, self.window.close)
            self._end.daemon = True
            self._end.start()
            self._send({"ask": True})

    def _tell(self, content: bytes) -> None:
        """Send a packed frame, or the error that ended the window."""
        if content.startswith(b"!"):
            self._send({"error": content[1:].decode("utf-8", "replace")})
            return
        self._send({}, [content])
        picture = self._pieces.take(content)
        if picture is not None and picture[0] == "image/png":
            self._last.take(picture[1])


def page_script() -> str:
    """Return the module of a widget's page, which imports nothing and asks no server for anything."""
    return "".join((_PAGE / name).read_text("utf-8") for name in ("view.js", "widget.js"))


def _check_libraries() -> None:
    """Raise MissingExtraError if a library is not installed."""
    try:
        import anywidget  # noqa: F401
        import PIL.Image  # noqa: F401 (packs frames)
        import traitlets  # noqa: F401
    except ModuleNotFoundError as error:
        raise missing_extra(error.name or "anywidget", "notebook", "texvol.show in a notebook") from error


@cache
def _widget_class() -> Any:
    """Return the class of widgets, which is made once anywidget is wanted."""
    import anywidget
    import traitlets

    class Widget(anywidget.AnyWidget):
        """Window in a cell; `close()` ends it."""

        _esm = page_script()
        width, height = traitlets.Int().tag(sync=True), traitlets.Int().tag(sync=True)
        title, output = traitlets.Unicode().tag(sync=True), traitlets.Unicode().tag(sync=True)
        picture = traitlets.Bytes().tag(sync=True)  # PNG at rest: saved with the state, it needs no kernel

        def __init__(self, window: Window) -> None:
            super().__init__(width=window.size[0], height=window.size[1], title=window.title)
            self.last = LastPicture(window.size[0], lambda: first_picture(window)._repr_png_() or b"")
            self.last.put.append(self.keep)
            self.below = Output(repr(self), lambda: Shot(self.last.png, self.last.width))
            self.output = self.below.name
            self.cells = Cells(window, self.send, self.last)
            self.on_msg(lambda _, message, __: self.cells.hear(message))

        def __repr__(self) -> str:
            return f"<{self.title}, {self.width} x {self.height}>"

        def _ipython_display_(self) -> None:
            self.keep()
            self.below.display(self._repr_mimebundle_())
            if self.below.update not in self.last.put:
                self.last.put.append(self.below.update)

        def keep(self) -> None:
            """Keep the last picture in the state of the widget, and in cells that show it."""
            self.set_trait("picture", self.last.png)

        def close(self) -> None:
            """End the window, and close the widget."""
            self.cells.window.close()
            super().close()

    return Widget


def first_picture(window: Window) -> Picture:
    """Return the picture of a window that no cell has shown yet."""
    backend, device = window.drawn_by
    return render(window.scene, window.size, backend=backend, device=device)
