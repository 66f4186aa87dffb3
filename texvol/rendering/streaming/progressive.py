"""Pictures of large volumes from coarse to fine: a first one from a coarse level, and finer ones in its place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import largest_difference
from texvol.rendering.renderer import Renderer
from texvol.rendering.streaming.kinds import needs_memory
from texvol.rendering.streaming.levels import settled_level
from texvol.scene.display import NUMBER_MODES
from texvol.scene.large_volume import LargeVolume
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.scene import Scene

_FIRST = 1 << 21  # samples of the first level, at most: drawn in well under a second
_LEAST_SIDE = 16  # samples along the longest side: fewer show nothing that anybody recognises
_LEAST_PIXELS = 128  # along the shorter side: of smaller pictures a quarter of the pixels saves no time


@dataclass(frozen=True)
class Stage:
    """One of the pictures, from coarse to fine."""

    picture: NDArray[np.float32]
    level: int | None  # None for the last, which is the one that was asked for
    moved: float | None  # largest difference from the picture before it; None for the first
    shrunk: int = 1  # pixels for one that was drawn, along each axis

    @property
    def sentence(self) -> str:
        """Level of the picture and how far off it may be, in words."""
        if self.level is None:
            return "the whole picture"
        moved = "nothing to compare it with" if self.moved is None else f"{self.moved:.2g} from the coarser one before"
        of = f"level {self.level}" + (" with a quarter of the pixels" if self.shrunk > 1 else "")
        return f"a picture of {of}, {moved}"


def render_progressively(
    renderer: Renderer, scene: Scene, size: AnySize = (512, 512), **accuracy: Any
) -> Iterator[Stage]:
    """Yield pictures of a scene from coarse to fine, the last of them that of `Renderer.render`.

    How much a picture moves from one to the next is about how far the former was off: levels halve in resolution. A
    scene that is not of large volumes has one picture.

    Parameters
    ----------
    accuracy
        Arguments of `Renderer.render` for the last picture.
    """
    before, size = None, checked_size(size)
    for stage in coarse_pictures(renderer, scene, size, accuracy):
        before = stage.picture
        yield stage
    picture = renderer.render(scene, size, **accuracy)
    yield Stage(picture, None, _moved(picture, before))


def coarse_pictures(
    renderer: Renderer, scene: Scene, size: tuple[int, int], accuracy: dict[str, Any]
) -> Iterator[Stage]:
    """Yield the pictures of `render_progressively` without the last.

    The first is drawn with a quarter of the pixels if that shows what its level holds.
    """
    before: NDArray[np.float32] | None = None
    for level in coarse_levels(scene, size, accuracy):
        half = max(size[0] // 2, 1), max(size[1] // 2, 1)
        shrinks = before is None and min(half) >= _LEAST_PIXELS and scene.mode not in NUMBER_MODES
        shrinks &= settled_level(scene.completed(half), half, "auto", None) <= level
        drawn = renderer.render(scene, half if shrinks else size, level=level)
        picture = _enlarged(drawn, size) if shrinks else drawn
        yield Stage(picture, level, _moved(picture, before), 1 + shrinks)
        before = picture


def coarse_levels(scene: Scene, size: tuple[int, int], accuracy: dict[str, Any]) -> list[int]:
    """Return the levels of the pictures before the last, coarsest first."""
    volume = scene.volume
    if needs_memory(scene, accuracy.get("texture_refinement")) or not isinstance(volume, LargeVolume):
        return []
    asked = 0 if accuracy.get("max_error") is not None else accuracy.get("level", "auto")
    last = settled_level(scene.completed(size), size, asked, accuracy.get("slab_thickness"))
    shapes = [level.source.shape for level in volume.levels]
    few = [n for n, shape in enumerate(shapes) if np.prod(shape, dtype=float) <= _FIRST and max(shape) >= _LEAST_SIDE]
    return list(range(few[0], last, -1)) if few else list(range(len(shapes) - 1, last, -1))


def _enlarged(picture: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a picture at another size, interpolated between the middles of its pixels."""
    for axis, count in ((0, size[1]), (1, size[0])):
        there = picture.shape[axis]
        at = np.clip((np.arange(count) + 0.5) * there / count - 0.5, 0, there - 1)
        first = np.minimum(at.astype(int), max(there - 2, 0))
        fraction = (at - first).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (-1, 1))
        before, after = picture.take(first, axis), picture.take(np.minimum(first + 1, there - 1), axis)
        picture = before + (after - before) * fraction
    return picture


def _moved(picture: NDArray[np.float32], before: NDArray[np.float32] | None) -> float | None:
    return None if before is None else largest_difference(picture, before)
