"""The oracle's picture of large volumes, region by region: only chunks that the asked rays pass are read.

A region's part of the picture is that of its samples and those around, cut off by planes at the region's faces. Parts
of a medium and of isosurfaces are composited front to back; a pixel that is opaque asks for nothing behind. In the
modes whose pictures are numbers the numbers of the parts are joined.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.streaming.exact_regions import regions_of_oracle
from texvol.rendering.streaming.kinds import all_in_parts, fits, large_volumes, reason_for_memory
from texvol.rendering.streaming.ordering import with_settled_light
from texvol.scene.cutting import ClipPlane
from texvol.scene.large_volume import LargeVolume
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.scene import NUMBER_MODES, CompleteScene, Scene
from texvol.slicing.coverage import pixels_of
from texvol.slicing.regions import Region

Numbers = NDArray[np.float64]
_OPAQUE = 1e-12  # transmittance that shows in no digit of the oracle
# Samples from the middle between two, where a surface may lie in a whole face, and rounding on either side of it.
_ASIDE = 0.0041
_MOST_WHOLE = 2e9  # bytes of samples that are read as a whole where they fit, whatever of them shows


def raycast(
    scene: Scene,
    size: AnySize = (512, 512),
    *,
    texture_refinement: int = 1,
    shadow_nodes: int | None = None,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Numbers:
    """Return the exact picture of a scene: see `texvol.ray_casting.raycast`.

    A `LargeVolume` that does not fit in its memory, or of which more would be read than shows, is read and integrated
    region by region.

    Raises
    ------
    InputError
        As `texvol.ray_casting.raycast`; or if a volume neither fits in memory nor can be integrated in parts.
    """
    from texvol import ray_casting

    size = checked_size(size)
    if is_in_parts(scene) and texture_refinement == 1 and not _is_to_be_whole(scene):
        return raycast_pixels(scene, size, _all_pixels(size), tell).reshape(*size[::-1], 4)
    how: dict[str, Any] = {"texture_refinement": texture_refinement, "shadow_nodes": shadow_nodes}
    return ray_casting.raycast(scene.in_memory("the oracle"), size, **how, tell=tell)


def raycast_pixels(
    scene: Scene,
    size: tuple[int, int],
    pixels: NDArray[np.intp],
    tell: Callable[[float], None] = lambda fraction: None,
) -> Numbers:
    """Return some pixels of the picture that `raycast` returns, shape (n, 4).

    Parameters
    ----------
    pixels : array of shape (n, 2)
        Column and row of each, counted from the top left.
    tell : callable
        Is told again and again what fraction is done.
    """
    if not is_in_parts(scene):
        from texvol import ray_casting

        return ray_casting.raycast_pixels(scene.in_memory("the oracle"), size, pixels, tell)
    if scene.added:
        scene = all_in_parts(scene)
    complete = _settled(scene.completed(size))
    kind = _Joined if scene.mode in NUMBER_MODES else _Composited
    return _in_parts(complete, size, pixels, kind(complete, size, pixels), tell)


def isosurface_depth(scene: Scene, size: AnySize = (512, 512)) -> Numbers:
    """Return the depth of the isosurface, see `texvol.ray_casting.projection.isosurface_depth`, region by region.

    Raises
    ------
    InputError
        As `texvol.ray_casting.projection.isosurface_depth`; or if a volume neither fits in memory nor can be integrated
        in parts.
    """
    size = checked_size(size)
    if not is_in_parts(scene) or fits(scene):
        from texvol.ray_casting import projection

        return projection.isosurface_depth(scene.in_memory("the oracle"), size)
    complete, pixels = scene.completed(size), _all_pixels(size)
    return _in_parts(complete, size, pixels, _Nearest(size, pixels), lambda fraction: None).reshape(size[::-1])


def _all_pixels(size: tuple[int, int]) -> NDArray[np.intp]:
    """Return column and row of all pixels, row after row, shape (n, 2)."""
    width, height = size
    rows, columns = np.divmod(np.arange(width * height), width)
    return np.column_stack([columns, rows])


def _in_parts(
    complete: CompleteScene,
    size: tuple[int, int],
    pixels: NDArray[np.intp],
    picture: _Picture,
    tell: Callable[[float], None],
) -> Numbers:
    """Return the pixels of a picture that is made of the regions of large volumes."""
    regions = regions_of_oracle(complete, size)
    frame, aside = regions.frame, _ASIDE if complete.mode == "isosurface" else 0.0
    number = np.full((size[1], size[0]), -1)
    number[pixels[:, 1], pixels[:, 0]] = np.arange(len(pixels))
    try:
        for done, region in enumerate(regions.order):
            tell(done / len(regions.order))
            box = region.box(frame.dimensions) + _ASIDE * np.array([[0.0], [1.0]]) / frame.dimensions
            where, mask = pixels_of(frame, complete.camera, size, np.clip(box, 0, 1))
            passing = number[where][mask]
            passing = picture.open_among(passing[passing >= 0])
            if not passing.size:
                continue
            planes = complete.clip + _faces(frame, region, aside)
            picture.add(replace(regions.scene_of(region), clip=planes, background=(0.0, 0.0, 0.0)), passing)
    finally:
        regions.close()
    return picture.finished()


class _Picture(Protocol):
    """Pixels that parts are added to, front to back."""

    def open_among(self, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return those of some pixels, by number, that a part behind may change."""

    def add(self, part: CompleteScene, numbers: NDArray[np.intp]) -> None:
        """Add a part in some pixels."""

    def finished(self) -> Numbers:
        """Return the pixels."""


class _Composited:
    """Pixels of the picture of a medium or of surfaces, behind which parts are composited, front to back."""

    def __init__(self, scene: CompleteScene, size: tuple[int, int], pixels: NDArray[np.intp]) -> None:
        self._scene, self._size, self._pixels = scene, size, pixels
        self._picture = np.zeros((len(pixels), 4))

    def open_among(self, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return those of some pixels, by number, in which something behind would show."""
        return numbers[self._picture[numbers, 3] < 1 - _OPAQUE]

    def add(self, part: CompleteScene, numbers: NDArray[np.intp]) -> None:
        """Add a part in some pixels."""
        from texvol import ray_casting

        behind = ray_casting.raycast_pixels(part, self._size, self._pixels[numbers])
        self._picture[numbers] += (1 - self._picture[numbers, 3:]) * behind

    def finished(self) -> Numbers:
        """Return the pixels over the background, shape (n, 4)."""
        self._picture[:, :3] += (1 - self._picture[:, 3:]) * np.array(self._scene.background)
        return self._picture


class _Joined:
    """Pixels of a picture of numbers, to which those of the parts are joined in any order."""

    def __init__(self, scene: CompleteScene, size: tuple[int, int], pixels: NDArray[np.intp]) -> None:
        self._scene, self._size, self._pixels = scene, size, pixels
        self._numbers = np.zeros((len(pixels), 2))

    def open_among(self, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the pixels themselves."""
        return numbers

    def add(self, part: CompleteScene, numbers: NDArray[np.intp]) -> None:
        """Join a part's numbers in some pixels."""
        from texvol.ray_casting.projection.pictures import numbers_along_rays, together

        columns, rows = self._pixels[numbers].T
        found = numbers_along_rays(part, self._size, lambda array: array[rows, columns][:, np.newaxis])[:, 0]
        self._numbers[numbers] = together(self._scene, self._numbers[numbers], found)

    def finished(self) -> Numbers:
        """Return the pixels, shape (n, 4)."""
        from texvol.ray_casting.projection.pictures import picture_of_numbers

        return picture_of_numbers(self._scene, self._numbers)


class _Nearest:
    """Depths of the first surface in some pixels."""

    def __init__(self, size: tuple[int, int], pixels: NDArray[np.intp]) -> None:
        self._size, self._pixels = size, pixels
        self._depths = np.full(len(pixels), np.inf)

    def open_among(self, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return those of some pixels, by number, in which no surface was found."""
        return numbers[np.isinf(self._depths[numbers])]

    def add(self, part: CompleteScene, numbers: NDArray[np.intp]) -> None:
        """Find the surface in a part in some pixels."""
        from texvol.ray_casting import projection

        columns, rows = self._pixels[numbers].T
        chosen = projection.isosurface_depth(part, self._size, lambda array: array[rows, columns][:, np.newaxis])
        self._depths[numbers] = chosen[:, 0]

    def finished(self) -> Numbers:
        """Return the depths, shape (n,)."""
        return self._depths


def is_in_parts(scene: Scene) -> bool:
    """True if the oracle can integrate the scene region by region."""
    if not any(isinstance(volume, LargeVolume) for volume in scene.volumes):
        return False
    if scene.cutting.caps and scene.mode == "composite":
        return False
    return reason_for_memory(scene) is None


def _is_to_be_whole(scene: Scene) -> bool:
    """True if the samples of all volumes fit in memory, and are few or there already."""
    unread = [volume for volume in large_volumes(scene) if "whole" not in vars(volume)]
    return fits(scene) and sum(volume.levels[0].bytes for volume in unread) <= _MOST_WHOLE


def _settled(scene: CompleteScene) -> CompleteScene:
    """Return the scene with light and depth cue that do not depend on the volume that is put in its place."""
    if scene.mode in NUMBER_MODES:
        return scene
    if not scene.added:  # of several volumes each has a fade of its own
        scene = with_settled_light(scene)
    if scene.depth_cue is None:
        return scene
    near, far = scene.depth_cue.range_for(scene.box, scene.camera)
    return replace(scene, depth_cue=replace(scene.depth_cue, near=near, far=far))


def _faces(volume: LargeVolume, region: Region, aside: float) -> tuple[ClipPlane, ...]:
    """Return planes at the faces that a region shares with others, moved aside by so many samples along each axis."""
    planes = []
    for axis in range(3):
        row = volume.index_from_world[axis]
        at = float(row @ volume.origin)
        if region.first[axis] > 0:
            planes.append(ClipPlane(tuple(row.tolist()), at + region.first[axis] - 0.5 + aside))
        if region.last[axis] < volume.dimensions[axis]:
            planes.append(ClipPlane(tuple((-row).tolist()), -(at + region.last[axis] - 0.5 + aside)))
    return tuple(planes)
