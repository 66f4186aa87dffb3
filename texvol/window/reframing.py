"""Framing of a large scene whose box or picture's size has changed: on a thread, so that the window draws on."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from texvol.scene.scene import Scene
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.navigation import View, on_content


@dataclass
class Search:
    """Search for the home view of a scene; `found` is None until it is over, or if it fails."""

    document: Document
    scene: Scene
    start: View
    size: tuple[int, int]
    found: View | None = None
    over: bool = False

    def fits(self, document: Document, size: tuple[int, int]) -> bool:
        """True if the view is that of a document, as it is now."""
        same = document is self.document and document.scene.volumes == self.scene.volumes
        return same and size == self.size

    def run(self, desk: Desk) -> None:
        """Search, and wake the window."""
        try:
            self.found = on_content(self.start, self.scene, self.size[0] / self.size[1])
        finally:
            self.over = True
            desk.wake()


def follow(desk: Desk) -> None:
    """Frame the open scene anew if that was put off, once its view has been found."""
    document, search = desk.document, desk.search
    if search is not None and search.over:
        desk.search = None
        if document is not None and document.unframed and search.fits(document, desk.pixels):
            document.unframed = False
            if document.at_home and search.found is not None:
                document.take_home(search.found, search.size)
    if document is not None and document.unframed and desk.search is None and document.home is not None:
        start = View(document.home.plain, document.view.pivot)
        desk.search = Search(document, document.scene, start, desk.pixels)
        threading.Thread(target=desk.search.run, args=(desk,), daemon=True, name="texvol framing").start()
