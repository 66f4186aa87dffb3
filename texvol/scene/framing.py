"""Cameras that frame what shows of a scene, from a named side or by angles.

The samples that show are projected to a coarse picture of opacities. The smallest rectangle with all but half a per
cent of its light on each side fills `FILL` of the picture, unless clearly visible parts, all but a twentieth of that,
would reach its border.

Directions are those of the body where the volume's file names them. Otherwise the front is the side of lower y,
the right side that of higher x, and up is z. If no side is chosen, `first_side` turns what the front shows badly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene import orbit
from texvol.scene.camera import Camera, Projection
from texvol.scene.content import Content, content_of
from texvol.scene.first_side import towards_side
from texvol.scene.scene_parts import SceneParts
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume
from texvol.util.threads import in_threads

Numbers = NDArray[np.float64]

FILL = 0.9  # of the picture, what shows
_BORDER = 0.98  # of the picture, all of what shows clearly
_CUT, _CLEARLY = 0.005, 0.00025  # fractions of the light outside of a rectangle, on each side
_BINS = 128  # of the coarse picture, along its longer side
_STEPS = 6  # towards the distance of a perspective eye; each leaves a tenth of the error

VIEWS = ("front", "back", "left", "right", "top", "bottom", "iso")
# Azimuth from the front to the right, and elevation, degrees.
_ANGLES = {
    "front": (0.0, 0.0), "right": (90.0, 0.0), "back": (180.0, 0.0), "left": (-90.0, 0.0),
    "top": (0.0, 90.0), "bottom": (0.0, -90.0), "iso": (45.0, 35.264389682754654),
}  # fmt: skip


@dataclass(frozen=True)
class ViewChoice:
    """Side that a scene is seen from; without any part of it, the front from one side and a little above."""

    view: str | None = None  # one of VIEWS
    azimuth: float | None = None  # degrees, beyond those of the view, or else from the front
    elevation: float | None = None

    def __bool__(self) -> bool:
        """True if anything is chosen."""
        return not (self.view is None and self.azimuth is None and self.elevation is None)


class Extent(NamedTuple):
    """Ends of what shows across and upwards, each (low, high), in world units or, in perspective, slopes."""

    across: tuple[float, float]
    above: tuple[float, float]


def view_of(volume: Volume, choice: ViewChoice) -> tuple[Numbers, Numbers]:
    """Return the direction from the target to the eye, and the direction that is up, unit vectors of the world."""
    front, right, up = _sides(volume)
    azimuth, elevation = _ANGLES[choice.view or "front"]
    azimuth, elevation = np.radians([azimuth + (choice.azimuth or 0.0), elevation + (choice.elevation or 0.0)])
    level = np.cos(azimuth) * front + np.sin(azimuth) * right
    return np.cos(elevation) * level + np.sin(elevation) * up, np.cos(elevation) * up - np.sin(elevation) * level


def _sides(volume: Volume) -> tuple[Numbers, Numbers, Numbers]:
    """Return unit vectors to the front, the right and up."""
    letters = letters_of_space(volume.space)
    if letters is None:
        return np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])

    def towards(wanted: str) -> Numbers:
        return np.array([float(each == wanted) - float(each == OPPOSITE[wanted]) for each in letters])

    return towards("A"), towards("R"), towards("S")


def framed(
    scene: SceneParts,
    projection: Projection = "orthographic",
    *,
    choice: ViewChoice | None = None,
    up: Sequence[float] | None = None,
    fov: float | None = None,
    aspect: float = 1.0,
    whole_box: bool = False,
    turning: bool = False,
    turn: orbit.Turn | None = None,
) -> Camera:
    """Return a camera that frames what shows of a scene with a look, or its box.

    Parameters
    ----------
    choice : ViewChoice, optional
    up : (x, y, z), optional
        Direction that points up in the picture.
    fov : float, optional
        Degrees from bottom to top, in perspective.
    aspect : float
        Width over height.
    whole_box : bool
        True to frame the box; also done if nothing shows.
    turning : bool
        True to have everything in the picture from all sides about `up`, or about the axis of `turn`.
    turn : Turn, optional
    """
    box, eye, towards = scene.box, None, None
    if choice:
        towards, upward = view_of(box, choice)
        eye, up = tuple(box.centre + 2 * box.radius * towards), tuple(upward) if up is None else up
    camera = Camera.framing(box, projection, eye=eye, up=up, fov=fov, aspect=aspect)
    of_values = scene.mode not in ("composite", "isosurface")  # which show in all of the box
    whole_box = whole_box or (of_values and not scene.cutting and scene.mask is None)
    content = Content.nothing(box) if whole_box else content_of(scene)
    if turning:
        part = _box_of(content, box) if content else box
        return orbit.framing(part, projection, towards=towards, up=up, fov=fov, aspect=aspect, turn=turn)
    if not content:
        return camera if eye is None else _around(box, camera, aspect)
    if eye is None:
        camera = towards_side(camera, scene.volume, _box_of(content, box))
    return _filled(camera, content, aspect, box)


def filled(camera: Camera, scene: SceneParts, aspect: float) -> Camera:
    """Return a camera of the same direction in which what shows of a scene with a look fills the picture."""
    content = content_of(scene)
    return _filled(camera, content, aspect, scene.box) if content else camera


def _filled(camera: Camera, content: Content, aspect: float, box: Volume) -> Camera:
    if camera.projection == "perspective":
        return _perspective(camera, content, aspect)
    return _level(camera, content, aspect, box)


def zoomed(camera: Camera, factor: float) -> Camera:
    """Return the camera with everything `factor` times as large in the middle of the picture."""
    if camera.projection == "orthographic":
        return replace(camera, height=camera.height / factor)
    slope = np.tan(np.radians(camera.fov) / 2) / factor
    return replace(camera, fov=float(np.degrees(2 * np.arctan(slope))))


def _around(box: Volume, camera: Camera, aspect: float) -> Camera:
    """Return the camera moved so that all of a box is in the picture."""
    if camera.projection == "perspective":
        return camera.at_distance(camera.fitting_distance(box, aspect))
    return camera


def _box_of(content: Content, box: Volume) -> Volume:
    """Return the box around what shows, with the axes of the scene's box, that holds it from every side."""
    weights = content.amounts
    axes = box.direction / np.linalg.norm(box.direction, axis=0)
    along = np.einsum("nk,jk->jn", content.points, np.linalg.inv(axes))
    ends = np.array(in_threads(lambda each: _ends(each, weights, _CLEARLY, content.apart), list(along)))
    middle = content.about + axes @ ends.mean(axis=1)
    edges = np.maximum(np.ptp(ends, axis=1), 1e-6 * box.radius)
    return Volume(np.zeros((1, 1, 1)), edges.tolist(), middle, axes, space=box.space)


def _ends(positions: Numbers, weights: Numbers, cut: float, apart: float) -> tuple[float, float]:
    """Return the positions outside of which lies a fraction `cut` of the weights on each side, and half a cell more."""
    order = np.argsort(positions)
    sums = np.cumsum(np.minimum(weights[order], weights.mean() * 10))
    low, high = np.searchsorted(sums, (cut * sums[-1], (1 - cut) * sums[-1]))
    last = positions.size - 1
    return float(positions[order[min(low, last)]]) - apart / 2, float(positions[order[min(high, last)]]) + apart / 2


def _typical(numbers: NDArray[np.float64]) -> float:
    """Return one in the middle of the order; numpy's median imports masked arrays, which takes a while."""
    middle = numbers.size // 2
    return float(np.partition(numbers, middle)[middle])


def _level(camera: Camera, content: Content, aspect: float, box: Volume) -> Camera:
    """Return an orthographic camera that frames what shows."""
    places = camera.in_eye_space(content.points, content.about)
    typical, clearly = _extents(content, places[:, :2])
    middle, height = _fitting(typical, clearly, aspect)
    depth = _typical(places[:, 2])
    target = np.array(camera.eye) + middle[0] * camera.right + middle[1] * camera.upward + depth * camera.forward
    away = 2 * box.radius + float(np.linalg.norm(target - box.centre))
    return replace(camera, eye=tuple(target - away * camera.forward), target=tuple(target), height=height)


def _perspective(camera: Camera, content: Content, aspect: float) -> Camera:
    """Return a perspective camera that frames what shows, found by steps: slopes depend on the distance."""
    for _ in range(_STEPS):
        places = camera.in_eye_space(content.points, content.about)
        nearest = float(places[:, 2].min())
        depth = _typical(places[:, 2])
        if nearest <= 1e-3 * depth:  # the eye is among the samples
            camera = _moved(camera, (0.0, 0.0), depth, 2 * max(depth, float(np.ptp(places[:, 2]))))
            continue
        slopes = places[:, :2] / places[:, 2:]
        typical, clearly = _extents(content, slopes, 1 / places[:, 2], 1 / depth)
        middle, height = _fitting(typical, clearly, aspect)
        camera = _moved(
            camera, (middle[0] * depth, middle[1] * depth), depth, depth * height / (2 * camera.half_height)
        )
    return camera


def _moved(camera: Camera, across: tuple[float, float], depth: float, distance: float) -> Camera:
    """Return the camera with its target at a depth, moved across the view, and its eye at a distance from that."""
    shift = across[0] * camera.right + across[1] * camera.upward
    target = np.array(camera.eye) + shift + depth * camera.forward
    return replace(camera, eye=tuple(target - distance * camera.forward), target=tuple(target))


def _fitting(typical: Extent, clearly: Extent, aspect: float) -> tuple[tuple[float, float], float]:
    """Return the middle of what shows, and the height of the picture that it fits into."""
    (left, right), (bottom, top) = typical
    middle = ((left + right) / 2, (bottom + top) / 2)
    height = max((top - bottom) / FILL, (right - left) / FILL / aspect)
    reaches = [
        max(high - centre, centre - low) * 2 / _BORDER / scale
        for (low, high), centre, scale in zip(clearly, middle, (aspect, 1.0), strict=True)
    ]
    return middle, max(height, *reaches, 1e-300)


def extent_seen(camera: Camera, content: Content) -> tuple[Extent, float] | None:
    """Return the ends of what shows, in halves of the picture's height from its middle, and the depth of that.

    None if nothing shows, or something lies behind the eye.
    """
    places = camera.in_eye_space(content.points, content.about)
    depth = _typical(places[:, 2]) if places.size else 0.0
    if not places.size or places[:, 2].min() <= 1e-3 * depth:
        return None
    if camera.projection == "orthographic":
        half = camera.half_height
        return _extents(content, places[:, :2] / half, 1 / half, 1 / half)[0], depth
    scale = places[:, 2:] * camera.half_height
    return _extents(content, places[:, :2] / scale, 1 / scale[:, 0], 1 / scale.mean())[0], depth


def _extents(
    content: Content, places: Numbers, scales: Numbers | float = 1.0, scale: float = 1.0
) -> tuple[Extent, Extent]:
    """Return the ends of all but half a per cent of the light on each side, and of all that shows clearly.

    `places` are positions across and upwards, shape (n, 2), in a plane in which lengths at the content's points are
    `scales` times, and typically `scale` times, as long as in the world.
    """
    amounts, apart = content.amounts * np.square(scales), content.apart * scale
    low, high = places.min(axis=0) - apart / 2, places.max(axis=0) + apart / 2
    width = max(float((high - low).max()) / _BINS, 1.5 * apart, 1e-300)
    counts = np.maximum(np.ceil((high - low) / width).astype(int), 1)
    column, row = np.minimum(((places - low) / width).astype(int), counts - 1).T
    sums = np.bincount(column * counts[1] + row, weights=amounts, minlength=int(counts.prod()))
    opacity = -np.expm1(-sums.reshape(counts) / width**2)
    opacity[opacity < content.faint] = 0.0
    if not opacity.any():
        opacity = sums.reshape(counts)
    ends = [
        [_quantiles(opacity.sum(axis=1 - axis), cut, float(low[axis]), width) for axis in range(2)]
        for cut in (_CUT, _CLEARLY)
    ]
    return Extent(*ends[0]), Extent(*ends[1])


def _quantiles(light: Numbers, cut: float, low: float, width: float) -> tuple[float, float]:
    """Return the positions outside of which lies a fraction `cut` of the light on each side, linear within a bin."""
    sums = np.concatenate([[0.0], np.cumsum(light)])
    edges = low + width * np.arange(sums.size)
    shown = np.flatnonzero(light)
    first, last = int(shown[0]), int(shown[-1]) + 1
    begin, end = np.interp((cut * sums[-1], (1 - cut) * sums[-1]), sums[first : last + 1], edges[first : last + 1])
    return float(begin), float(end)
