"""Camera that leaves room for annotation: it keeps its direction, and moves back and sideways.

The box is to lie between x = l and r and between y = b and t of the picture. Here x and y are distances across the view
divided by half the picture's height (orthographic), or by that times the depth (perspective). A corner at (x, y) and
depth z, seen from an eye that is d farther back and e farther to the right, lies at

    (x - e) / (h (z + d))

All corners lie right of l and left of r for some e if and only if

    h d (r - l) ≥ max(x - r h z) - min(x - l h z)

which is linear in d; e is then the middle of the allowed interval. In orthographic projection the height replaces h d,
and z drops out. The same holds for y; the larger of the two distances is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from texvol.annotation.drawing import check_drawable
from texvol.annotation.legend import legends_width
from texvol.annotation.legend_content import contents_of
from texvol.annotation.request import Annotation
from texvol.annotation.sheet import Sheet
from texvol.scene.camera import FRAMING_MARGIN, Camera
from texvol.scene.content import content_of
from texvol.scene.framing import extent_seen
from texvol.scene.scene import Scene

# Margins of the parts in ems: left, right, top, bottom.
_TITLE = (0.0, 0.0, 2.2, 0.0)
_LETTERS = (2.0, 2.0, 2.0, 2.0)
_SCALE_BAR = (0.0, 0.0, 0.0, 2.6)
_AXES = (4.5, 2.5, 1.0, 3.5)
_LEGEND_AIR = 1.2
_LEAST_LEFT = 0.78  # least fraction of each side that is left to the picture; annotation then lies over its edges
_LEAST, _ENOUGH = 0.70, 0.71  # of the picture: less than the first, and what shows is enlarged to the second
_BORDER = 1 - 1 / FRAMING_MARGIN  # in half heights: of each side without annotation
_STEPS = 4  # towards a perspective eye
Ranges = tuple[tuple[float, float], ...]  # across and upwards


def framed_with_margins(camera: Camera, scene: Scene, size: tuple[int, int], annotation: Annotation) -> Camera:
    """Return the moved camera; see `annotation.with_room`."""
    free, beside_legend = _free(scene, size, annotation)
    around_box = _box_in(free, camera, scene)
    if scene.mode not in ("composite", "isosurface"):
        return around_box
    return _filled(around_box, free, beside_legend, scene, size[0] / size[1])


def _filled(camera: Camera, free: Ranges, beside_legend: float, scene: Scene, aspect: float) -> Camera:
    """Return the camera nearer to what shows if that fills less than `_LEAST` of the picture, whatever of the box.

    What shows ends at `beside_legend` at the right, as far as there is room at the left.
    """
    content = content_of(scene.looked)
    for step in range(_STEPS):
        seen = extent_seen(camera, content) if content else None
        if seen is None:
            return camera
        extent, depth = seen
        (left, right), (bottom, top) = extent
        side = max((right - left) / (2 * aspect), (top - bottom) / 2)
        if side >= (_LEAST if step == 0 else _ENOUGH * (1 - 1e-3)):
            return camera
        closer = side / _ENOUGH
        half = camera.half_height * (depth if camera.projection == "perspective" else 1.0)
        seen_at, wanted = (np.mean(each, axis=1) for each in (extent, free))
        reach = (right - left) / 2 / closer
        wanted[0] = max(min(wanted[0], beside_legend - reach), reach + _BORDER - aspect)
        shift = (half * (seen_at - closer * wanted)).tolist()
        if camera.projection == "orthographic":
            camera = _moved(replace(camera, height=camera.height * closer), shift, 0.0)
        else:
            camera = _moved(camera, shift, -depth * (1 - closer))
    return camera


def _box_in(free: tuple[tuple[float, float], ...], camera: Camera, scene: Scene) -> Camera:
    """Return the camera moved so that the box fits into what the annotation leaves free."""
    (left, right), (bottom, top) = free
    corners = np.concatenate([
        camera.in_eye_space(volume.corners_from_centre, volume.centre) for volume in scene.volumes
    ])  # fmt: skip
    x, y, z = corners.T
    # Depths are counted from the target, because the eye's distance is what is chosen.
    z = z - camera.target_distance
    axes = (x, left, right), (y, bottom, top)
    if camera.projection == "orthographic":
        half = max(np.ptp(x) / (right - left), np.ptp(y) / (top - bottom))
        shift = [(each.min() + each.max()) / 2 - (low + high) / 2 * half for each, low, high in axes]
        return _moved(replace(camera, height=2 * float(half)), shift, 0.0)
    slope = camera.half_height
    distance = max(
        (np.max(each - high * slope * z) - np.min(each - low * slope * z)) / (slope * (high - low))
        for each, low, high in axes
    )
    depths = slope * (z + distance)
    shift = [(np.max(each - high * depths) + np.min(each - low * depths)) / 2 for each, low, high in axes]
    back = float(distance) - camera.target_distance
    return _moved(camera, shift, back)


def _moved(camera: Camera, shift: list[float], back: float) -> Camera:
    across = shift[0] * camera.right + shift[1] * camera.upward
    eye = np.array(camera.eye) + across - back * camera.forward
    return replace(camera, eye=tuple(eye), target=tuple(np.array(camera.target) + across))


def _free(scene: Scene, size: tuple[int, int], annotation: Annotation) -> tuple[Ranges, float]:
    """Return the ranges of the picture that annotation leaves free, across and upwards, and where the legend begins.

    All are in half heights from the middle.
    """
    sheet = Sheet(size, check_drawable(annotation, scene), scene.background, annotation.color, annotation.font_size)
    parts = (
        (annotation.title, _TITLE), (annotation.orientation, _LETTERS), (annotation.axes, _AXES),
        (annotation.scale_bar, _SCALE_BAR),
    )  # fmt: skip
    asked = np.array([part for wanted, part in parts if wanted]).reshape(-1, 4)
    left, right, top, bottom = (sheet.em * asked.sum(axis=0)).tolist()
    legend = _legend_width(sheet, scene, annotation)
    right += legend
    width, height = size
    beside_legend = (width - 2 * (legend + _LETTERS[1] * sheet.em * annotation.orientation)) / height
    border = _BORDER / 2 * height
    sides = []
    for before, after, count in ((left, right, width), (bottom, top, height)):
        before, after = max(before, border), max(after, border)
        most = (1 - _LEAST_LEFT) * count
        shrunk = min(1.0, most / (before + after))
        sides.append((2 * before * shrunk / height - count / height, count / height - 2 * after * shrunk / height))
    return tuple(sides), beside_legend


def _legend_width(sheet: Sheet, scene: Scene, annotation: Annotation) -> float:
    """Return the pixels that the legends take at the right, with the air beside them."""
    if not annotation.legend:
        return 0.0
    if scene.mode in ("xray", "average"):  # an estimate: their numbers are not known yet
        return 2 * _LETTERS[0] * sheet.em + _LEGEND_AIR * sheet.em
    contents = contents_of(scene, annotation.value_name, None, sheet.letters)
    return legends_width(sheet, contents) + _LEGEND_AIR * sheet.em * bool(contents)
