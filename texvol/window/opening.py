"""Opening, adding and dropping of files: each file that is added is one step of the scene's history."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from texvol.geometry import load_mesh
from texvol.options.files import TransformChoice
from texvol.options.looks import load_look
from texvol.scene.added_volume import AddedVolume
from texvol.scene.demo import demo_scene
from texvol.scene.mask import Mask
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.window import contents, label_looks, placing, recent_looks
from texvol.window.desk import Desk
from texvol.window.document import Document, Origin, opened_file
from texvol.window.editing import with_file, with_own
from texvol.window.naming import how_read
from texvol.window.questions import Question


def open_file(desk: Desk, path: str, options: Mapping[str, Any] | None = None) -> None:
    """Open a volume or a scene, or add a mesh or a transfer function to the scene that is open.

    Parameters
    ----------
    options : mapping, optional
        Command-line options of the volume, as `contents.of_opened` returns them.
    """
    kind = contents.kind_of(path)
    if kind == "transfer function" and desk.document is not None:
        scene = desk.document.scene
        volume = scene.volume
        if desk.attempt(lambda: desk.change(**with_file(scene, load_look(path, volume)))):
            recent_looks.add(path)
    elif kind == "mesh":
        add(desk, path)
    elif kind == "names of labels":
        label_looks.take_names(desk, label_looks.number_of_labels(desk), path)
    else:
        size = desk.pixels
        desk.load(path, lambda: opened_file(path, size, options))


def browse_to_open(desk: Desk) -> None:
    """Show the file browser, and open the chosen file with the entered options."""
    title = "Open a volume, a scene, a mesh or a transfer function"
    desk.browse(title, lambda path, words: open_file(desk, path, contents.of_opened(words)), takes_words=True)


def browse_to_add(desk: Desk) -> None:
    """Show the file browser, and add the chosen volume or mesh with the entered options."""
    title = "Add a volume or a mesh"
    desk.browse(title, lambda path, words: add(desk, path, contents.of_added(words)), takes_words=True)


def browse_for_mask(desk: Desk, volume: Volume) -> None:
    """Show the file browser, and apply the chosen mask to a volume."""
    desk.browse("Mask of the volume", lambda path, _: mask(desk, volume, path))


def drop(desk: Desk, paths: Sequence[str], *, adds: bool = False) -> None:
    """Open or add files that were dropped on the window together.

    The user is asked about volumes, which can be opened or added, unless `adds` is True or nothing is open yet.
    """
    volumes = tuple(path for path in paths if contents.kind_of(path) == "volume")
    for path in paths:
        if contents.kind_of(path) == "scene":
            open_file(desk, path)
    if volumes and adds and desk.document is not None:
        for path in volumes:
            add(desk, path)
    elif volumes and desk.document is not None:
        _offer(desk, desk.document, volumes)
    elif volumes:
        open_all(desk, volumes)
    for path in paths:
        if contents.kind_of(path) in ("mesh", "transfer function", "names of labels"):
            open_file(desk, path)


def _offer(desk: Desk, document: Document, paths: tuple[str, ...]) -> None:
    """Ask whether dropped volumes are to be opened or added."""
    opens = "open it" if len(paths) == 1 else "open as one scene"
    answers: dict[str, Callable[[], None]] = {
        opens: lambda: open_all(desk, paths),
        "add to the scene": lambda: drop(desk, paths, adds=True),
        "use as a mask of the volume": lambda: mask(desk, document.scene.volume, paths[0]),
    }
    if len(paths) > 1 or document.scene.mask is not None:
        del answers["use as a mask of the volume"]
    notes = (f"{document.name} is kept: undo returns to it.",)
    desk.ask(Question(f"What is to be done with {contents.named(paths)}?", answers, notes, of_scene=True))


def sample(desk: Desk) -> None:
    """Open the built-in scene."""
    size = desk.pixels
    desk.load("sample", lambda: Document(demo_scene(), Origin("sample"), size=size))


def open_all(desk: Desk, volumes: tuple[str, ...]) -> None:
    """Open the first volume, and add the other volumes to its scene."""
    size = desk.pixels
    first, *others = volumes
    options = {"add": [contents.AddedChoice(path) for path in others]} if others else {}
    desk.load(first, lambda: opened_file(first, size, options))


def add(desk: Desk, path: str, chosen: Mapping[str, Any] | None = None) -> None:
    """Add a volume or a mesh to the scene.

    Parameters
    ----------
    chosen : mapping, optional
        Options of a volume, as `contents.of_added` returns them.
    """
    document = desk.document
    if document is None:
        desk.say(f"{path}: no scene is open; open a volume before you add a file", fault=True)
        return

    def make() -> Mesh | AddedVolume:
        if contents.kind_of(path) == "mesh":
            return load_mesh(path)
        found = contents.read_volume(path, document.scene, chosen or {})
        document.histogram(found.volume)
        return found

    def take(found: Mesh | AddedVolume) -> None:
        if isinstance(found, Mesh):
            document.change(geometry=(*document.scene.geometry, found))
        else:
            document.change(added=(*document.scene.added, found))
            desk.panel_state["volume"] = len(document.scene.added)  # select the new volume in the panel

    desk.fetch(path, make, take)


def like(volume: Volume) -> dict[str, Any]:
    """Return the options of an added volume that is read from the same image and lies where another one lies."""
    how = {name.replace("_", "-"): value for name, value in how_read(volume.source).items() if name != "labels"}
    matrix = placing.transform_of(volume)
    moved = not np.array_equal(matrix, np.eye(4))
    return how | ({"transform": TransformChoice(tuple(matrix.ravel().tolist()))} if moved else {})


def mask(desk: Desk, volume: Volume, path: str, fade: tuple[float, float] | None = None) -> None:
    """Apply a mask from a file to a volume of the scene."""
    document = desk.document
    assert document is not None

    def take(found: Mask) -> None:
        if volume in document.scene.volumes:
            document.change(**with_own(document.scene, document.scene.volumes.index(volume), mask=found))

    desk.fetch(path, lambda: contents.read_mask(path, volume, fade), take)
