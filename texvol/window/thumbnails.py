"""Small pictures of saved views: at first part of the picture that is shown, then drawn while nothing else is."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.annotation import Annotation
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.tour import SavedView
from texvol.window.director import Director
from texvol.window.document import Document

SIZE = (128, 80)  # pixels; shown smaller where the screen is not scaled
_LOOK = tuple(part.name for part in fields(Scene) if part.name != "camera")


class Thumbnail(NamedTuple):
    """Small picture, a number of its own, and the scene that it shows; None if that is not known."""

    pixels: NDArray[np.uint8]
    version: int
    scene: Scene | None


@dataclass
class Thumbnails:
    """Small pictures by their cameras."""

    pictures: dict[Camera, Thumbnail] = field(default_factory=dict)
    versions: Iterator[int] = field(default_factory=itertools.count)
    wanted: bool = False  # the list of views was shown in the last frame

    def get(self, view: SavedView) -> Thumbnail | None:
        """Return the picture of a view, if there is one."""
        self.wanted = True
        return self.pictures.get(view.camera)

    def capture(self, director: Director, camera: Camera) -> None:
        """Take the picture that is shown as that of a camera, until it is drawn without annotation."""
        shown = director.shown
        if shown is not None:
            self.pictures[camera] = Thumbnail(_small(shown.pixels), next(self.versions), None)

    def step(self, document: Document | None, director: Director) -> None:
        """Drop the pictures of views that are gone; if the list of views is shown, have the next picture drawn.

        That is one that is missing, or shows another scene.
        """
        wanted, self.wanted = self.wanted, False
        if document is None or not (wanted or self.pictures):
            return
        cameras = {each.camera for each in document.tour.views}
        for camera in self.pictures.keys() - cameras:  # also unseen: a picture holds the volumes of its scene
            del self.pictures[camera]
        if not wanted:
            return
        scene = document.scene
        missing = next((each for each in cameras if not self._is_of(each, scene)), None)
        if missing is None:
            return

        def take(pixels: NDArray[np.uint8], camera: Camera = missing) -> None:
            self.pictures[camera] = Thumbnail(pixels, next(self.versions), scene)

        showing = replace(document.showing, annotation=Annotation())
        director.aside(replace(scene, camera=missing), SIZE, showing, take)

    def _is_of(self, camera: Camera, scene: Scene) -> bool:
        known = self.pictures.get(camera)
        if known is None or known.scene is None:
            return False
        before = known.scene
        return all(getattr(before, name) == getattr(scene, name) for name in _LOOK)


def _small(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the middle of a picture, with all of its height, reduced to SIZE by the nearest pixels."""
    height, width, _ = pixels.shape
    scale = height / SIZE[1]
    rows = ((np.arange(SIZE[1]) + 0.5) * scale).astype(int)
    columns = ((np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * scale + width / 2).astype(int)
    found = pixels[rows[:, np.newaxis], np.clip(columns, 0, width - 1), :3]  # without the opacity, if there is one
    found[:, (columns < 0) | (columns >= width)] = 0
    return np.ascontiguousarray(found)
