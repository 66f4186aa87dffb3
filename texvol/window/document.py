"""What is open: a scene, the view of it, where it came from; and its history, to undo and redo.

A scene is never changed: whoever changes something puts another one in its place. Changes of one *stroke*, a drag of a
slider, are one step of the history. The view is no part of it: to undo a colour does not turn the picture.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from operator import is_
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.annotation import Annotation, check, with_room
from texvol.options.scene_options import SceneOptions
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window.histogram import Histogram, histogram_of
from texvol.window.jobs import Showing
from texvol.window.navigation import View, framed

_LONGEST = 200  # steps: they share all that they have in common


@dataclass(frozen=True)
class Origin:
    """What was opened."""

    volume: str
    scene_file: str | None = None
    transfer_function: str | None = None  # as it was named


class Home(NamedTuple):
    """A view that nobody chose: as the box alone would be framed, and with room for the annotation."""

    plain: Camera
    roomy: Camera

    @classmethod
    def of(cls, plain: Camera, scene: Scene, size: tuple[int, int], annotation: Annotation) -> Home:
        """The view of a scene in so many pixels."""
        return cls(plain, with_room(plain, scene, size, annotation) if annotation else plain)


class Saved(NamedTuple):
    """What was written as a scene file, and where."""

    path: str
    scene: Scene
    showing: Showing
    size: tuple[int, int]


class History:
    """Scenes that were, and scenes that were undone."""

    def __init__(self, scene: Scene) -> None:
        self._past: list[Scene] = []
        self._future: list[Scene] = []
        self._now = scene
        self._stroke: str | None = None

    @property
    def now(self) -> Scene:
        """The scene as it is."""
        return self._now

    @property
    def can_undo(self) -> bool:
        """Whether there is a step back."""
        return bool(self._past)

    @property
    def can_redo(self) -> bool:
        """Whether there is a step forward."""
        return bool(self._future)

    def change(self, scene: Scene, stroke: str | None = None) -> None:
        """Another scene; of the same stroke as the last change it is the same step."""
        if stroke is None or stroke != self._stroke:
            self._past = [*self._past[-_LONGEST:], self._now]
        self._stroke, self._now, self._future = stroke, scene, []

    def end_stroke(self) -> None:
        """The hand has let go: the next change is another step."""
        self._stroke = None

    def undo(self) -> None:
        """One step back, if there is one."""
        if self._past:
            self._future.append(self._now)
            self._now, self._stroke = self._past.pop(), None

    def redo(self) -> None:
        """One step forward, if there is one."""
        if self._future:
            self._past.append(self._now)
            self._now, self._stroke = self._future.pop(), None


class Document:
    """An open scene.

    Parameters
    ----------
    scene : Scene
        With a camera.
    size : (width, height), optional
        Pixels of the picture.
    """

    def __init__(
        self, scene: Scene, origin: Origin, showing: Showing | None = None, size: tuple[int, int] | None = None
    ) -> None:
        assert scene.camera is not None
        self.origin, self.showing = origin, showing or Showing()
        self.saved: Saved | None = None
        self.home: Home | None = None
        self._size = size
        self._view = View.of(scene.camera)
        self._history = History(scene)
        self._scene = scene
        self._opened = scene, self.showing
        self._histograms: WeakKeyDictionary[Volume, Histogram] = WeakKeyDictionary()
        for volume in scene.volumes:
            self.know(volume)

    @property
    def scene(self) -> Scene:
        """The scene, seen by the view's camera; the same object for as long as nothing changes."""
        return self._scene

    def histogram(self, number: int) -> Histogram:
        """The histogram of the scene's volume of that number."""
        return self.know(self._scene.volumes[number])

    def know(self, volume: Volume) -> Histogram:
        """The histogram of a volume, found when first asked for: which is better done on the thread that reads it."""
        if volume not in self._histograms:
            self._histograms[volume] = histogram_of(volume)
        return self._histograms[volume]

    @property
    def unsaved(self) -> bool:
        """Whether more than the view differs from what was opened, or was written as a scene file last."""
        scene, showing = self._opened if self.saved is None else (self.saved.scene, self.saved.showing)
        names = [part.name for part in fields(Scene) if part.name != "camera"]
        return showing != self.showing or any(getattr(scene, name) != getattr(self._scene, name) for name in names)

    @property
    def view(self) -> View:
        """The view."""
        return self._view

    @property
    def history(self) -> History:
        """What can be undone and redone."""
        return self._history

    @property
    def at_home(self) -> bool:
        """Whether nobody has changed the view since `go_home`."""
        return self.home is not None and self.home.roomy == self._view.camera

    def look(self, view: View) -> None:
        """Another view."""
        if view.camera != self._view.camera:
            self._scene = replace(self._scene, camera=view.camera)
        self._view = view

    def go_home(self, home: Home) -> None:
        """A view that leaves the annotation its room, for as long as nobody chooses another."""
        self.look(replace(self._view, camera=home.roomy))
        self.home = home

    def annotate(self, annotation: Annotation, size: tuple[int, int]) -> None:
        """Other annotation of a picture of that size; a view that nobody has changed makes room for it.

        Raises
        ------
        InputError, MissingExtraError
            If it can't be drawn; the old one stays.
        """
        check(annotation, self._scene)
        home = self.home
        if home is not None and self.at_home:
            self.go_home(Home.of(home.plain, self._scene, size, annotation))
        self.show(annotation=annotation)

    def fit(self, size: tuple[int, int]) -> None:
        """Have a view that nobody has changed show the whole box, in a picture of that size from now on."""
        self._size = size
        home = self.home
        if home is not None and self.at_home:
            view = framed(View(home.plain, self._view.pivot), self._scene.box, size[0] / size[1])
            self.look(view)
            self.go_home(Home.of(view.camera, self._scene, size, self.showing.annotation))

    def change(self, stroke: str | None = None, **parts: Any) -> None:
        """Other parts of the scene, by name.

        Raises
        ------
        InputError
            If they make no scene; the old one stays.
        """
        scene = replace(self._scene, **parts)
        self._history.change(scene, stroke)
        self._become(scene)

    def show(self, **parts: Any) -> None:
        """Other parts of how it is shown."""
        self.showing = replace(self.showing, **parts)

    def undo(self) -> None:
        """One step back."""
        self._history.undo()
        self._become(replace(self._history.now, camera=self._view.camera))

    def redo(self) -> None:
        """One step forward."""
        self._history.redo()
        self._become(replace(self._history.now, camera=self._view.camera))

    def _become(self, scene: Scene) -> None:
        """Another scene; what is added or taken away may change its box."""
        before, self._scene = self._scene, scene
        same = len(before.volumes) == len(scene.volumes) and all(map(is_, before.volumes, scene.volumes))
        if self._size and not same and not np.array_equal(_corners(before.box), _corners(scene.box)):
            self.fit(self._size)


def _corners(box: Volume) -> NDArray[np.float64]:
    corners: NDArray[np.float64] = box.corners_from_centre + box.centre
    return corners


def opened(arguments: argparse.Namespace, size: tuple[int, int]) -> Document:
    """The document that options of the line and of a scene file make, framed for so many pixels; loads the volume.

    Raises
    ------
    InputError
        As `texvol render` does.
    """
    options = SceneOptions(arguments)
    options.size = size
    volume = options.load()
    scene = _with_all_medium(options.scene(volume, in_8_bits=True))
    check(options.annotation, scene)
    showing = Showing(options.window, options.transparent, options.annotation)
    origin = Origin(options.volume, arguments.scene, options.transfer_function)
    document = Document(scene, origin, showing, size)
    if not options.chose_view:
        document.go_home(Home.of(document.view.camera, scene, size, options.annotation))
    return document


def _with_all_medium(scene: Scene) -> Scene:
    """The scene in which every volume has the transfer function that it would be drawn with, to be edited."""
    if not scene.added:
        return scene
    from texvol.scene.transfer import proposed_for

    every = (
        each if each.transfer_function else replace(each, transfer_function=proposed_for(each.volume))
        for each in scene.added
    )
    return replace(scene, added=tuple(every))


def opened_file(path: str, size: tuple[int, int], how: Mapping[str, Any] | None = None) -> Document:
    """The document of a volume, which may have to be told how it is read, or of a scene file."""
    if path.lower().endswith(".json"):
        raise InputError(f"{path}: a transfer function is opened into a scene: open a volume first")
    is_scene = path.lower().endswith(".toml")
    named = {"volume": None, "scene": path} if is_scene else {"volume": path, "scene": None, **(how or {})}
    return opened(argparse.Namespace(**named), size)
