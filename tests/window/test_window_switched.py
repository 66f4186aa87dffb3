"""Light, crop box and clip planes that are switched off and on again are as before."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window import switched
from texvol.window.document import Document, Origin
from texvol.window.handles import bounds

FOG = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.1]))
VOLUME = Volume(np.ones((4, 5, 6), np.float32))
LIGHT = Lighting((Light("directional", (1.0, 2.0, 3.0)),), ambient=0.25, shininess=7.0, shadows=True)
PLANES = tuple(ClipPlane(normal, 1.0) for normal in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def document(**parts: Any) -> Document:
    return Document(Scene(VOLUME, FOG, Camera.framing(VOLUME), **parts), Origin("v.npy"))


def switch_light(opened: Document) -> Lighting | None:
    opened.change(**switched.light_switched(opened.scene, opened.off))
    return opened.scene.lighting


def test_light_comes_back_with_all_that_was_set() -> None:
    opened = document(lighting=LIGHT)
    assert [switch_light(opened), switch_light(opened)] == [None, LIGHT]
    assert switch_light(document()) == Lighting(), "there was none before"


def test_light_comes_back_without_shadows_where_there_can_be_none() -> None:
    opened = document(lighting=LIGHT)
    switch_light(opened)
    opened.change(mode="isosurface", isovalue=0.5)
    lighting = switch_light(opened)
    assert lighting is not None and not lighting.shadows and lighting.ambient == LIGHT.ambient


def test_a_crop_box_comes_back_and_is_the_whole_box_at_first() -> None:
    opened = document()
    whole = bounds(opened.scene.box)

    def switch() -> Any:
        opened.change(**switched.crop_switched(opened.scene, opened.off, whole))
        return opened.scene.crop

    assert switch() == whole
    smaller = ((1.0, 2.0), (1.0, 3.0), (0.5, 2.0))
    opened.change(crop=smaller)
    assert [switch(), switch()] == [None, smaller]


def test_a_plane_that_is_off_cuts_nothing_and_keeps_its_place() -> None:
    opened = document(clip=PLANES)

    def switch(number: int) -> None:
        planes = switched.all_planes(opened.scene, opened.off)
        planes[number] = (planes[number][0], not planes[number][1])
        opened.change(**switched.planes_changed(planes, opened.off))

    switch(0)
    switch(1)
    assert opened.scene.clip == PLANES[2:]
    assert switched.all_planes(opened.scene, opened.off) == list(zip(PLANES, (False, False, True), strict=True))
    switch(0)
    assert opened.scene.clip == (PLANES[0], PLANES[2])
    opened.undo()
    opened.undo()
    assert switched.all_planes(opened.scene, opened.off)[:2] == [(PLANES[0], False), (PLANES[1], True)]
    opened.undo()
    assert opened.scene.clip == PLANES and not opened.off.planes
    opened.redo()
    assert opened.scene.clip == PLANES[1:] and opened.off.planes == ((0, PLANES[0]),)
