"""Small pictures that are drawn along with that of a large volume, part by part, and tell its error.

A part is forgotten once it has been drawn, and an estimate by pictures that come later reads all of them again. So two
pictures of few rays, one with slabs of a quarter of the thickness, are drawn from each part while it is on the device.
"""

from __future__ import annotations

import math
from dataclasses import replace

from texvol.opengl.compositor import Compositor, Target
from texvol.opengl.drawing import Drawing, View
from texvol.opengl.part_store import Part
from texvol.rendering.error_control import estimate, rounding_of, thinnest
from texvol.rendering.streaming.parts import PictureOfParts
from texvol.scene.picture_size import shrunk

_HALVINGS = 2  # of the slab thickness, from one picture to the other
_MOST_PIXELS = 96  # along a side: both pictures take a tenth of the time of 512×512 pixels; fewer pixels know less
_LEAST_BYTES = 1e7  # of texels: fewer are drawn again within a second, and first progressive pictures are quicker


def tells_error(picture: PictureOfParts, texel_bytes: float) -> bool:
    """Return True if small pictures can tell a picture's error, and cost less than to read its parts once more.

    `texel_bytes` is how many bytes of texels its regions have. Those of `slab` hold slabs of one thickness, and tell
    nothing of thinner ones.
    """
    scene, drawing = picture.scene, picture.drawing
    can_be = scene.mode == "composite" and scene.classification != "slab" and not drawing.count
    finest = drawing.view.slab_thickness / 2**_HALVINGS
    return can_be and texel_bytes >= _LEAST_BYTES and finest >= thinnest(scene)


class SidePictures:
    """Two small pictures of a view, with slabs of its thickness and of a quarter of it."""

    def __init__(self, compositor: Compositor, picture: PictureOfParts) -> None:
        self._compositor, self._picture = compositor, picture
        view, size = picture.drawing.view, shrunk(picture.size, _MOST_PIXELS)
        thicknesses = view.slab_thickness, view.slab_thickness / 2**_HALVINGS
        views = [View(view.camera, size, each, view.origin) for each in thicknesses]
        self._drawings = [replace(picture.drawing, view=each) for each in views]
        self._targets = [compositor.empty_target(size) for _ in views]

    def draw(self, part: Part) -> None:
        """Composite a part behind each picture so far."""
        for drawing, target in self._each():
            with self._compositor.into(target):
                self._picture.draw_by(drawing, self._compositor, part)

    def error(self) -> float:
        """Estimate the largest error of all pixels of the picture, when all parts have been drawn."""
        found = []
        for drawing, target in self._each():
            with self._compositor.into(target):
                found.append(self._compositor.picture(drawing.color_scale))
        small, finer = found
        return estimate(small, finer, _HALVINGS, rounding_of(self._picture.scene), math.prod(self._picture.size))

    def release(self) -> None:
        """Release the targets."""
        for target in self._targets:
            self._compositor.release_target(target)

    def _each(self) -> list[tuple[Drawing, Target]]:
        return list(zip(self._drawings, self._targets, strict=True))
