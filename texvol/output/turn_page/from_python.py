"""Page that is dragged to turn, from Python: shown in notebooks, saved as a file."""

from __future__ import annotations

import argparse
import os
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, replace
from html import escape
from typing import Any

from texvol.options import texts
from texvol.output import sequences
from texvol.output.one_picture import ACCURACY, scene_of
from texvol.output.turn_page import page
from texvol.rendering.frames import Frame
from texvol.rendering.renderer import Renderer
from texvol.scene import orbit
from texvol.scene.scene import Scene
from texvol.util import writing
from texvol.util.errors import InputError


@dataclass(frozen=True)
class TurnPage:
    """Page that is dragged to turn.

    Attributes
    ----------
    html : str
        The page, which needs no other file and no network.
    said : str
        Number and quality of its views.
    size : (width, height)
        Pixels of a view.
    """

    html: str
    said: str
    size: tuple[int, int]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises
        ------
        InputError
            If the name does not end with .html, or the file can't be written.
        """
        if not page.is_page(path):
            raise InputError(f"{os.fspath(path)}: the name of a page must end with .html")
        writing.check_writable(path)
        writing.write_files({path: self.html.encode()})

    def __repr__(self) -> str:
        return f"TurnPage({self.said}, {len(self.html) / 1e6:.2g} MB)"

    def _repr_html_(self) -> str:
        """Return a frame that holds the page; it is part of a saved notebook."""
        width, height = self.size
        # Scripts run in a frame without an origin: they see nothing of the notebook.
        return (
            f'<iframe srcdoc="{escape(self.html)}" sandbox="allow-scripts" title="a scene to turn" width="100%" '
            f'height="{max(height, 180) + 150}" style="border:0;max-width:{max(width, 400) + 40}px"></iframe>'
        )


def turn_page(
    what: Any,
    views: str | int | tuple[int, int] = "36x7",
    size: Any = None,
    *,
    slices: bool = False,
    title: str = "",
    axis: str = "up",
    backend: str = "auto",
    device: int | str | None = None,
    **how: Any,
) -> TurnPage:
    """Return a page with pictures of a scene from all sides, which is dragged to turn.

    Parameters
    ----------
    what : Scene, Volume, path, array, or image of another library
        As for `render`.
    views : "COLUMNSxROWS", int or (columns, rows)
        Views around, and elevations.
    size : (width, height) or int, optional
        Pixels of a view; 512 x 512 by default. A page of many large views has a lower quality: it has 10 MB at most.
    slices : bool
        True to have axial, coronal and sagittal slices on the page, in 8 bits.
    title : str
        Title of the page; the volume's name if empty.
    axis : str
        Axis of the turn: one of up, picture, head, x, y, z.
    backend, device, how
        As for `render`.

    Raises
    ------
    InputError
        If a name is not known, a value is out of range, or the views do not fit on a page.
    """
    columns, rows = _views(views)
    turn = orbit.Turn(axis, rows=rows)
    accuracy = {name: how.pop(name) for name in ACCURACY if name in how}
    scene, size, _ = scene_of(what, size, **how)
    if columns * rows > page.MOST_VIEWS or max(size) > page.MOST_SIDE:
        raise InputError(f"views must be at most {page.MOST_VIEWS} of {page.MOST_SIDE} pixels, got {views!r} of {size}")
    framed = _framed(scene, size, turn)
    title = title or page.last_name(scene.volume.name or "scene")
    collection = page.Collection(framed, rows, title, scene.volume if slices else None)
    frames = sequences.views(framed, columns * rows, scene.volume.name, turn)
    with Renderer(backend, device=device) as renderer, closing(_drawn(renderer, frames, size, accuracy)) as drawn:
        for number, frame in enumerate(drawn):
            if number == 0:
                collection.about = page.details(frame.scene, error=renderer.quick_estimate())
            collection.add(frame.picture)
    html, said = collection.html()
    return TurnPage(html, said, size)


def _drawn(
    renderer: Renderer, frames: sequences.Frames, size: tuple[int, int], accuracy: dict[str, Any]
) -> Generator[Frame, None, None]:
    return renderer.frames(frames.scenes, size, count=frames.count, views=frames.views, **accuracy)


def _framed(scene: Scene, size: tuple[int, int], turn: orbit.Turn) -> Scene:
    """Return the scene with its camera, or one that keeps what shows in the picture from all sides."""
    if scene.camera is not None:
        return scene
    from texvol.scene.framing import framed

    camera = framed(scene.looked, aspect=size[0] / size[1], turning=True, turn=turn)
    return replace(scene, camera=camera)


def _views(views: object) -> tuple[int, int]:
    """Return the views around and the rows."""
    text = "x".join(map(str, views)) if isinstance(views, tuple | list) else str(views)
    try:
        return texts.orbit(text)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"views {error}") from None
