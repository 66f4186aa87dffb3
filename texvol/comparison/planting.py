"""Renderer with planted mistakes: shaders with a wrong function, slab stacks without a slab, other blending.

The shader files stay unchanged: a compositor of changed copies draws for a while, and the renderer keeps its textures.
See `wrong_functions` for the replacement of a shader's function.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from texvol.comparison.wrong_functions import WrongFunction, wrong_shaders
from texvol.opengl.compositor import Compositor, Drawing
from texvol.opengl.contexts import Context
from texvol.rendering.renderer import Renderer
from texvol.slicing.slabs import SlabStacks, slab_stacks

Slabs = tuple[int, int]  # first, and one after the last
# OpenGL's factors of blending (GL_ONE, GL_ONE_MINUS_SRC_ALPHA), for the source and the destination.
_ONE, _ONE_MINUS_SRC_ALPHA = 1, 0x0303
OVER_WHAT_IS_THERE = (_ONE, _ONE_MINUS_SRC_ALPHA)
UNDER_BY_ITS_OWN_ALPHA = (_ONE_MINUS_SRC_ALPHA, _ONE)


@dataclass(frozen=True)
class Planted:
    """A mistake of a renderer.

    Attributes
    ----------
    functions : sequence of (signature, body)
        Wrong functions of the shaders.
    dropped : (first, end), optional
        Slabs that are not drawn, counted as in `slicing`.
    under : pair of int, optional
        Blending of a slab stack with what is in front of it.
    """

    functions: Sequence[WrongFunction] = ()
    dropped: Slabs | None = None
    under: tuple[int, int] | None = None


class PlantedRenderer(Renderer):
    """Renderer in which a mistake can be planted temporarily."""

    @contextmanager
    def planted(self, mistake: Planted) -> Iterator[PlantedCompositor]:
        """Draw with the mistake, and by the returned compositor, inside the context.

        Raises
        ------
        ShaderError
            If the shaders have no such function.
        """
        right = self._compositor
        with wrong_shaders(*mistake.functions) as folder:
            with self._context:
                self._compositor = wrong = PlantedCompositor(self._context, folder, mistake)
                self._pictures.draw_by(wrong)
            try:
                yield wrong
            finally:
                with self._context:
                    wrong.release()
                self._compositor = right
                self._pictures.draw_by(right)

    def slab_range(self) -> Slabs:
        """Return the first slab of the last picture and the one after its last; (0, 0) for none."""
        if self._last is None:
            return 0, 0
        scene, size, settings = self._last
        stacks = slab_stacks(scene.box, scene.camera, settings.slab_thickness, size, about=scene.volume.centre)
        return (int(stacks.first[0]), int(stacks.last[-1])) if stacks.first.size else (0, 0)


class PlantedCompositor(Compositor):
    """Compositor with a mistake, which may leave out slabs and rows of pixels."""

    def __init__(self, context: Context, shaders: Path, mistake: Planted) -> None:
        super().__init__(context, shaders)
        self._dropped = mistake.dropped
        self._rows: tuple[int, int] | None = None
        self.pipeline = "fragment"  # whose blending and rows of pixels mistakes are of
        if mistake.under is not None:
            self.under = mistake.under

    def drop(self, slabs: Slabs | None) -> None:
        """Leave out these slabs only."""
        self._dropped = slabs

    def keep_rows(self, rows: tuple[int, int]) -> None:
        """Draw only the rows of pixels from the first to before the second, counted from the top."""
        self._rows = rows

    def begin(self, drawing: Drawing, target_format: str = "rgba32f") -> None:
        """Begin an empty picture."""
        super().begin(drawing, target_format)
        if self._rows is not None and self._target is not None:
            width, height = drawing.view.size
            self._target.scissor = (0, height - self._rows[1], width, self._rows[1] - self._rows[0])

    def draw_polygons(self, name: str, switches: dict[str, int], stacks: SlabStacks, *more: Any) -> None:
        """Draw the polygons without those of dropped slabs."""
        left = stacks if self._dropped is None else without(stacks, self._dropped)
        if left.first.size:
            super().draw_polygons(name, switches, left, *more)


def without(stacks: SlabStacks, dropped: Slabs) -> SlabStacks:
    """Return the stacks without some slabs: a stack that contains them becomes two, in front and behind."""
    first, end = dropped
    # Front and back part of each stack are neighbours, so that the order stays.
    firsts = np.stack([stacks.first, np.maximum(stacks.first, end)], axis=1).reshape(-1)
    lasts = np.stack([np.minimum(stacks.last, first), stacks.last], axis=1).reshape(-1)
    left = firsts < lasts
    polygons = stacks.polygons.repeat(2, axis=0)
    return replace(stacks, polygons=polygons[left], first=firsts[left], last=lasts[left])
