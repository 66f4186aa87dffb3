"""Writer of a page: it takes pictures as a writer of films does, and writes one file when all are there."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.output.turn_page.page import Collection, details, last_name
from texvol.scene.scene import Scene
from texvol.util import writing


class PageWriter:
    """Writer of the views of a scene to a page; nothing is written before `finish`.

    Parameters
    ----------
    path : path
    first : Scene
        Scene with the camera whose view is shown first.
    title : str
        Title of the page; the file's name if empty.
    rows : int
        Rows of the orbit.
    with_slices : bool
        True to have slices of the first volume on the page.
    """

    def __init__(
        self, path: str | os.PathLike[str], first: Scene, *, title: str = "", rows: int = 1, with_slices: bool = False
    ) -> None:
        self._path = path
        title = title or last_name(first.volume.name or os.fspath(path))
        self._page = Collection(first, rows, title, first.volume if with_slices else None)
        self.stats: dict[str, Any] = {}
        self.show: Callable[[str], None] = lambda text: None  # of the progress of `finish`, where that takes long

    def add(self, picture: NDArray[np.float32], attributes: Mapping[str, str] | None = None) -> None:
        """Add the next view."""
        self._page.add(picture)

    def describe(self, scene: Scene, name: str, error: float | None) -> None:
        """Set the details of the page by its first view: the scene that was drawn, its file, the estimated error."""
        self._page.about = details(scene, [name] if name else [], error)

    def finish(self) -> None:
        """Write the page.

        Raises
        ------
        InputError
            If the views do not fit, or the file can't be written.
        """
        count = len(self._page.files)

        def tell(number: int) -> None:
            self.show(f"texvol: compressing view {number} of {count}")

        html, self.stats["page"] = self._page.html(tell)
        writing.write_files({self._path: html.encode()})

    def __enter__(self) -> PageWriter:
        return self

    def __exit__(self, *_: object) -> None:
        """Leave: there is nothing to remove."""
