"""Where a scene has nothing to show: which cells a ray leaps over, and which bricks are not drawn at all."""

from __future__ import annotations

import moderngl
import numpy as np

from texvol.bricks import Brick
from texvol.cells import Cells
from texvol.transfer import TransferFunction
from texvol.volume import Volume


class EmptySpace:
    """The cells of the last volume, and the leaps for its last transfer function as a texture on the device."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._volume: Volume | None = None
        self._transfer_function: TransferFunction | None = None
        self._cells: Cells | None = None
        self._visible = np.zeros((0, 0, 0), np.bool_)
        self._leaps: moderngl.Texture3D | None = None

    def prepare(self, volume: Volume, transfer_function: TransferFunction) -> None:
        """Find out what of a volume is empty; what is known already is kept."""
        if self._volume is not volume:
            self.release()
            self._cells, self._volume = Cells.of(volume), volume
        if self._transfer_function is transfer_function:
            return
        assert self._cells is not None
        self._visible = self._cells.visible(transfer_function)
        self._release_leaps()
        if not self._visible.all():
            leaps = self._cells.leaps(self._visible)
            nz, ny, nx = leaps.shape
            self._leaps = self._gl.texture3d((nx, ny, nz), 1, leaps, alignment=1, dtype="u1")
            self._leaps.filter = moderngl.NEAREST, moderngl.NEAREST
        self._transfer_function = transfer_function

    @property
    def leaps(self) -> moderngl.Texture3D | None:
        """`Cells.leaps` as a texture, or None where every cell shows something."""
        return self._leaps

    @property
    def cells_per_box(self) -> tuple[float, float, float]:
        """Along x, y, z."""
        assert self._cells is not None, "nothing has been prepared"
        return self._cells.per_box

    @property
    def counts(self) -> tuple[int, int]:
        """Number of cells, and of those that may show something."""
        return self._visible.size, int(self._visible.sum())

    def shows(self, brick: Brick) -> bool:
        """Whether a brick has a cell that may show something, samples stored for the neighbours' sake included."""
        assert self._cells is not None, "nothing has been prepared"
        z, y, x = (
            slice(first // size, -(-last // size))
            for first, last, size in zip(
                reversed(brick.stored_first), reversed(brick.stored_last), reversed(self._cells.size), strict=True
            )
        )
        return bool(self._visible[z, y, x].any())

    def release(self) -> None:
        """Give the texture back and forget the volume."""
        self._release_leaps()
        self._volume = self._cells = None

    def _release_leaps(self) -> None:
        if self._leaps is not None:
            self._leaps.release()
        self._leaps = self._transfer_function = None
