"""Planes of the slices in the 3D view: outlines over the picture, and the slices themselves if that is switched on.

They are drawn by the window over the picture, as lines of annotation are, so that a turn is as quick with them. The
picture's annotation is drawn once more over each part of a slice, so that letters are not covered.
Slices in the 3D view are cut at the crosshair into quarters, which are drawn from the farthest to the nearest: no
quarter meets another one, so that each hides what is behind it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts, tiles
from texvol.window.slice_layers import Layer
from texvol.window.slice_views import Plane, clipped, fractions_in, layer_corners
from texvol.window.slices import NAMES

_OUTLINE, _CROSS = 0xE0_00_00_00, 0x70_00_00_00  # alpha of lines
_PICTURE, _WHITE = 0xE6_FF_FF_FF, 0xFF_FF_FF_FF
Polygon = tuple[NDArray[np.float64], NDArray[np.float64]]  # corners in the window, and in the texture
_PARTS = 6  # along each side of a quarter, in perspective: a picture is drawn in parts without perspective of their own


def draw(desk: Desk) -> None:
    """Draw the planes over the picture while slices are shown beside it."""
    document, layout = desk.document, desk.layout
    if document is None or not layout.shown or layout.volume is not document.scene.volume:
        return
    if not (layout.planes or layout.pictures):
        return
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(*parts.corners(desk.viewport))
    if layout.pictures:
        _pictures(desk, document, drawn)
    if layout.planes:
        for name in NAMES:
            _outline(desk, document.view.camera, drawn, name)
    drawn.pop_clip_rect()


def _outline(desk: Desk, camera: Camera, drawn: Any, name: str) -> None:
    """Draw the border of a slice, and thinly its lines of the crosshair."""
    layout = desk.layout
    assert layout.volume is not None
    plane = Plane.of(layout.volume, layout.slices[name], layout.number(name))
    corners = np.array([plane.point(*each) for each in layer_corners(layout.volume, layout.slices[name], plane)])
    x, y = _fractions(desk, name)
    ends = [corners[0] + x * (corners[1] - corners[0]), corners[3] + x * (corners[2] - corners[3])]
    ends += [corners[0] + y * (corners[3] - corners[0]), corners[1] + y * (corners[2] - corners[1])]
    places = _placed(desk, camera, np.concatenate([corners, ends]))
    width = parts.scale()
    for one, other in ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (6, 7)):
        if np.isfinite(places[[one, other]]).all():
            alpha = _OUTLINE if one < 4 else _CROSS
            line = imgui.ImVec2(*places[one]), imgui.ImVec2(*places[other])
            drawn.add_line(*line, tiles.COLORS[name] | alpha, (1.5 if one < 4 else 1.0) * width)


def _fractions(desk: Desk, name: str) -> tuple[float, float]:
    """Return the position of the crosshair in the picture of a slice, as fractions from the left and from the top."""
    layout = desk.layout
    assert layout.volume is not None
    return layout.slices[name].fractions(layout.volume, layout.index)


def _placed(desk: Desk, camera: Camera, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the window coordinates of world points, shape (n, 2); NaN behind the eye."""
    right, up, depth = camera.in_eye_space(points, np.zeros(3)).T
    scale = camera.half_height * (np.where(depth > 0, depth, np.nan) if camera.projection == "perspective" else 1.0)
    box, half = desk.viewport, desk.viewport.height / 2
    return np.stack([box.x + box.width / 2 + right / scale * half, box.y + half - up / scale * half], axis=1)


def _pictures(desk: Desk, document: Document, drawn: Any) -> None:
    """Draw the slices in quarters, the farthest first."""
    layout, camera, annotation = desk.layout, document.view.camera, _annotation(desk)
    quarters = []
    for name in NAMES:
        plane = Plane.of(document.scene.volume, layout.slices[name], layout.number(name))
        found = tiles.layers_of(desk, document.scene, name, plane)
        x, y = _fractions(desk, name)
        for left, right in ((0.0, x), (x, 1.0)):
            for top, bottom in ((0.0, y), (y, 1.0)):
                if right > left and bottom > top:
                    corners = np.array([plane.point(*each) for each in found[0].corners])
                    middle = _at(corners, np.array([[(left + right) / 2, (top + bottom) / 2]]))
                    depth = float((middle[0] - np.array(camera.eye)) @ camera.forward)
                    quarters.append((depth, name, plane, found, (left, right, top, bottom)))
    further = round(255 * layout.opacity) << 24 | 0xFF_FF_FF
    for _, name, plane, layers, ends in sorted(quarters, key=lambda each: -each[0]):
        quads = _quads(desk, camera, plane, layers[0], ends)
        _add(drawn, _texture(desk, f"{name} 0", layers[0]), quads, _PICTURE)
        for number, layer in enumerate(layers[1:], 1):
            over = _over(desk, camera, plane, (layers[0], layer), ends)
            _add(drawn, _texture(desk, f"{name} {number}", layer), over, further)
        if annotation is not None:
            _add(drawn, annotation, [(corners, _in_picture(desk, corners)) for corners, _ in quads], _WHITE)


def _over(
    desk: Desk, camera: Camera, plane: Plane, layers: tuple[Layer, Layer], ends: tuple[float, float, float, float]
) -> list[Polygon]:
    """Return the part of a further volume's picture that is in a quarter; the quarter has no end beyond the first."""
    first, layer = layers
    found = fractions_in(layer.corners, np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)]), first.corners)
    if found is None:
        return []
    (left, top), (right, bottom) = np.minimum(found.min(axis=0), 0), np.maximum(found.max(axis=0), 1)
    wide = ends[0] or left, right if ends[1] == 1 else ends[1], ends[2] or top, bottom if ends[3] == 1 else ends[3]
    quads = _quads(desk, camera, plane, first, wide)
    inner = fractions_in(first.corners, np.array([each for _, each in quads]).reshape(-1, 2), layer.corners)
    if inner is None:
        return []
    corners = inner.reshape(-1, 4, 2)
    low, high = corners.min(axis=1), corners.max(axis=1)
    meets, within = ((low < 1) & (high > 0)).all(axis=1), ((low >= 0) & (high <= 1)).all(axis=1)
    polygons = [
        (quads[n][0], corners[n]) if within[n] else clipped(quads[n][0], corners[n]) for n in np.flatnonzero(meets)
    ]
    return [each for each in polygons if len(each[0]) > 2]


def _at(corners: NDArray[np.float64], fractions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the world points at fractions (from the left, from the top) of a parallelogram."""
    return np.asarray(corners[0] + fractions @ np.stack([corners[1] - corners[0], corners[3] - corners[0]]))


def _texture(desk: Desk, name: str, layer: Layer) -> Any:
    """Return the texture of a volume's slice."""
    assert desk.textures is not None
    return imgui.ImTextureRef(desk.textures.get(f"slice {name}", layer.key, layer.make, nearest=layer.nearest))


def _annotation(desk: Desk) -> Any:
    """Return the texture of the annotation of the shown picture; None if it has none."""
    shown, textures = desk.director.shown, desk.textures
    if shown is None or textures is None:
        return None
    number = desk.annotating.layer(textures, desk.pixels, desk.director.pictures, shown)
    return None if number is None else imgui.ImTextureRef(number)


def _quads(
    desk: Desk, camera: Camera, plane: Plane, layer: Layer, ends: tuple[float, float, float, float]
) -> list[Polygon]:
    """Return the parts of a quarter, several in perspective: corners in the window and in the slice's picture."""
    corners = np.array([plane.point(*each) for each in layer.corners])
    count = _PARTS if camera.projection == "perspective" else 1
    left, right, top, bottom = ends
    across, along = np.linspace(left, right, count + 1), np.linspace(top, bottom, count + 1)
    grid = np.stack(np.meshgrid(across, along), axis=-1)
    places = _placed(desk, camera, _at(corners, grid.reshape(-1, 2))).reshape(grid.shape)
    shown = np.isfinite(_cells(places)).all(axis=(1, 2))
    return list(zip(_cells(places)[shown], _cells(grid)[shown], strict=True))


def _cells(grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of all cells of a grid of points, shape (n, 4, 2), around each cell."""
    return np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 4, 2)


def _in_picture(desk: Desk, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places in the window as fractions of the 3D view, upwards."""
    box = desk.viewport
    return np.asarray((corners - (box.x, box.y + box.height)) / (box.width, -box.height))


def _add(drawn: Any, texture: Any, polygons: list[Polygon], color: int) -> None:
    """Draw convex polygons of a texture, in parts of four corners."""
    for corners, places in polygons:
        points, inside = ([imgui.ImVec2(*each) for each in which.tolist()] for which in (corners, places))
        for n in range(1, len(points) - 1, 2):
            part = 0, n, n + 1, min(n + 2, len(points) - 1)
            drawn.add_image_quad(texture, *[points[each] for each in part], *[inside[each] for each in part], color)
