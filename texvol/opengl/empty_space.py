"""Empty-space skipping: cells that a ray skips, and bricks that are not drawn."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.scene.mask import Mask
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.cells import Cells, Shown, skips_of
from texvol.textures.distribution import Spread


class EmptySpace:
    """The cells of the last volume, and the skips for what was last shown of it as a texture on the device."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._volume: Volume | None = None
        self._shown: tuple[Shown, int, Mask | None, tuple[float, float] | None] | None = None
        self._cells: Cells | None = None
        self._visible = np.zeros((0, 0, 0), np.bool_)
        self._skips: NDArray[np.uint8] | None = None  # of `Cells.skips`; None where every cell shows something
        self._texture: moderngl.Texture3D | None = None  # of these, made when it is first asked for
        self._parts: dict[Brick, NDArray[np.float64] | None] = {}

    @classmethod
    def known(cls, gl: moderngl.Context, visible: NDArray[np.bool_]) -> EmptySpace:
        """Return the empty space of a volume of which it is known which cells may show, shape (cz, cy, cx)."""
        space = cls(gl)
        space._visible = visible
        space._skips = None if visible.all() else skips_of(visible)
        return space

    def prepare(
        self,
        volume: Volume,
        shown: Shown,
        reach: int = 0,
        mask: Mask | None = None,
        steps: tuple[float, float] | None = None,
        of_samples: float | None = None,
        spread: Spread | None = None,
    ) -> None:
        """Find out what of a volume is empty; what is known already is kept. New ones need no context for it.

        `reach` is how many samples to each side the gradient depends on that decides what shows; 0 where none does.
        `steps` are those to which the texture rounds values. The volume may be a part of one `of_samples` samples, and
        its own may be `spread`.
        """
        if self._volume is not volume:
            self.release()
            self._cells, self._volume = Cells.of(volume, of_samples), volume
            if spread is not None:
                self._cells = self._cells.widened(spread.rows, spread.function.reach)
        if self._shown == (shown, reach, mask, steps):
            return
        assert self._cells is not None
        steepest = self._cells.steepest(volume, reach) if reach else np.inf
        self._visible = self._cells.visible(shown, steepest, mask, steps)
        self._parts.clear()
        self._release_skips()
        if not self._visible.all():
            self._skips = self._cells.skips(self._visible)
        self._shown = shown, reach, mask, steps

    @property
    def skips(self) -> moderngl.Texture3D | None:
        """Texture of `Cells.skips`; None where every cell shows something. The context has to be current."""
        if self._texture is None and self._skips is not None:
            nz, ny, nx = self._skips.shape
            self._texture = self._gl.texture3d((nx, ny, nz), 1, self._skips, alignment=1, dtype="u1")
            self._texture.filter = moderngl.NEAREST, moderngl.NEAREST
        return self._texture

    def forget_samples(self, instead: Volume) -> None:
        """Let the volume go whose cells are known; another one stands for it from now on."""
        self._volume = instead

    @property
    def cells_per_box(self) -> tuple[float, float, float]:
        """Along x, y, z."""
        assert self._cells is not None, "nothing has been prepared"
        return self._cells.per_box

    @property
    def counts(self) -> tuple[int, int]:
        """Number of cells, and of those that may show something."""
        return self._visible.size, int(self._visible.sum())

    @property
    def visible_box(self) -> NDArray[np.float64] | None:
        """Low and high corner of all that may show, in fractions of the box, shape (2, 3); None: nothing shows."""
        assert self._cells is not None, "nothing has been prepared"
        positions = np.nonzero(self._visible)
        if not positions[0].size:
            return None
        cells = np.array([[axis.min() for axis in positions], [axis.max() + 1 for axis in positions]])[:, ::-1]
        return np.minimum(cells / np.array(self._cells.per_box), 1.0)

    def visible_part(self, brick: Brick) -> NDArray[np.float64] | None:
        """Low and high corner of what a brick may show, in fractions of the box, shape (2, 3); None: nothing shows."""
        if brick not in self._parts:
            self._parts[brick] = self._find_visible_part(brick)
        return self._parts[brick]

    def _find_visible_part(self, brick: Brick) -> NDArray[np.float64] | None:
        assert self._cells is not None, "nothing has been prepared"
        size = np.array(self._cells.size)
        first, last = np.array(brick.stored_first) // size, -(-np.array(brick.stored_last) // size)
        z, y, x = (slice(a, b) for a, b in zip(first[::-1], last[::-1], strict=True))
        positions = np.nonzero(self._visible[z, y, x])
        if not positions[0].size:
            return None
        cells = np.array([[axis.min() for axis in positions], [axis.max() + 1 for axis in positions]])[:, ::-1] + first
        part = cells * size / np.array(brick.dimensions)
        stored = brick.stored_box
        return np.array([np.maximum(part[0], stored[0]), np.minimum(part[1], stored[1])])

    def release(self) -> None:
        """Release the texture and forget the volume."""
        self._release_skips()
        self._volume = self._cells = None

    def _release_skips(self) -> None:
        if self._texture is not None:
            self._texture.release()
        self._texture = self._skips = self._shown = None
