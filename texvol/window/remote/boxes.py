"""Boxes of widgets, such as HBox and Tab, that have windows in them: their cells show the last pictures, too.

A box displays itself and asks none of its children. So IPython is told how boxes are displayed, and a box without a
window is left as it was.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any

from texvol.window.remote.last_picture import Output, Shot

_MARGIN = 4  # pixels of the page between two pictures, as ipywidgets leaves between two widgets


def teach(is_window: Callable[[Any], bool]) -> None:
    """Make boxes show the last pictures of their windows in the IPython that runs, if one does."""
    try:
        from IPython.core.getipython import get_ipython
        from ipywidgets import Box
    except ModuleNotFoundError:
        return
    shell: Any = get_ipython()
    if shell is not None:
        formatter = shell.display_formatter.ipython_display_formatter
        formatter.for_type(Box, lambda box: _display(box, is_window))


def _display(box: Any, is_window: Callable[[Any], bool]) -> None:
    windows = list(dict.fromkeys(_windows(box, is_window)))
    if not windows:
        raise NotImplementedError  # IPython goes on as without this function
    output = Output(", ".join(map(repr, windows)), lambda: _shot(box, is_window))

    def put() -> None:
        windows[0].send({"put": output.name}, [output.update().png])

    for each in windows:
        each.keep()
        each.last.put.append(put)
    output.display(box._repr_mimebundle_())


def _windows(widget: Any, is_window: Callable[[Any], bool]) -> Iterator[Any]:
    """Yield the windows in a widget."""
    if is_window(widget):
        yield widget
    else:
        for each in getattr(widget, "children", ()):
            yield from _windows(each, is_window)


def _shot(box: Any, is_window: Callable[[Any], bool]) -> Shot:
    """Return the pictures of a box as one, arranged as the box arranges them; those of a Tab stand below each other."""
    scale = max(each.last.scale for each in _windows(box, is_window))
    image = _image(box, is_window, round(_MARGIN * scale))
    file = io.BytesIO()
    image.save(file, "PNG")
    return Shot(file.getvalue(), round(image.width / scale))


def _image(widget: Any, is_window: Callable[[Any], bool], margin: int) -> Any:
    """Return the picture of a widget; None if no window is in it."""
    from PIL import Image

    if is_window(widget):
        return Image.open(io.BytesIO(widget.last.png)).convert("RGBA")
    parts = (_image(each, is_window, margin) for each in getattr(widget, "children", ()))
    images = [each for each in parts if each is not None]
    if not images:
        return None
    along = 0 if _is_row(widget) else 1
    size = [max(each.size[axis] for each in images) for axis in (0, 1)]
    size[along] = sum(each.size[along] + margin for each in images) - margin
    whole, at = Image.new("RGBA", (size[0], size[1])), [0, 0]  # transparent beside a smaller picture
    for each in images:
        whole.paste(each, (at[0], at[1]))
        at[along] += each.size[along] + margin
    return whole


def _is_row(box: Any) -> bool:
    return type(box).__name__ in ("Box", "HBox")
