"""Files on their way into the scene: looked for, dropped, read, added; each is one step of the history."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.window import contents
from texvol.window.document import Document, opened_file

if TYPE_CHECKING:
    from texvol.window.desk import Desk

OPENS = "Open a volume, a scene, a mesh or a transfer function"


def browse_to_open(desk: Desk) -> None:
    """Have somebody look for a file to open, and say how it is read."""

    def opens(path: str, words: str) -> None:
        desk.attempt(lambda: desk.open(path, contents.of_opened(words)))

    desk.browse_for_data(OPENS, opens)


def browse_to_add(desk: Desk) -> None:
    """Have somebody look for a volume or a mesh to add, and say how it is read."""

    def adds(path: str, words: str) -> None:
        desk.attempt(lambda: desk.add(path, contents.of_added(words)))

    desk.browse_for_data("Add a volume or a mesh", adds)


def browse_for_mask(desk: Desk, volume: Volume) -> None:
    """Have somebody look for a mask of that volume."""
    desk.browse("Mask of the volume", lambda path: mask(desk, volume, path))


def drop(desk: Desk, paths: tuple[str, ...], *, adds: bool = False) -> None:
    """Files came in together: what is no volume says by its name what it is for, volumes are asked about."""
    volumes = tuple(path for path in paths if contents.kind_of(path) == "volume")
    for path in paths:
        if contents.kind_of(path) == "scene":
            desk.open(path)
    if desk.document is None and volumes:
        open_all(desk, volumes)
    elif volumes and adds:
        for path in volumes:
            desk.add(path)
    elif volumes:
        desk.offered = volumes
    for path in paths:
        if contents.kind_of(path) in ("mesh", "transfer function"):
            desk.open(path)


def open_all(desk: Desk, volumes: tuple[str, ...]) -> None:
    """Open the first one, and add the others to it."""
    size = desk.pixels
    first, *others = volumes

    def make() -> Document:
        how = {"add": [contents.AddedChoice(path) for path in others]} if others else {}
        return opened_file(first, size, how)

    desk.load(first, make)


def add(desk: Desk, path: str, chosen: Mapping[str, Any]) -> None:
    """Add what a file holds to the scene."""
    document = desk.document
    if document is None:
        desk.say(f"{path}: is added to a scene: open a volume first", fault=True)
        return
    if contents.kind_of(path) == "mesh":
        desk.fetch(path, lambda: contents.read_mesh(path), lambda found: _add_mesh(desk, document, found))
        return

    def make() -> AddedVolume:
        found = contents.read_volume(path, document.scene, chosen)
        document.know(found.volume)
        return found

    desk.fetch(path, make, lambda found: _add_volume(desk, document, found))


def mask(desk: Desk, volume: Volume, path: str, fade: tuple[float, float] | None = None) -> None:
    """Lay a mask on a volume of the scene."""
    document = desk.document
    assert document is not None

    def take(found: Mask) -> None:
        if volume in document.scene.volumes:
            document.change(**contents.with_mask(document.scene, volume, found))

    desk.fetch(path, lambda: contents.read_mask(path, volume, fade), take)


def _add_mesh(desk: Desk, document: Document, mesh: Mesh) -> None:
    document.change(geometry=(*document.scene.geometry, mesh))


def _add_volume(desk: Desk, document: Document, added: AddedVolume) -> None:
    document.change(added=(*document.scene.added, added))
    desk.panel_state["volume"] = len(document.scene.added)  # that is edited
