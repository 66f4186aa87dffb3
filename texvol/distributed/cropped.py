"""Pictures cropped to what they cover, and *over* of two of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Cropped:
    """Premultiplied float32 picture, (height, width, 4), whose top left pixel is at (row, column) of the whole."""

    pixels: NDArray[np.float32]
    row: int = 0
    column: int = 0

    @property
    def is_empty(self) -> bool:
        """True if it covers nothing."""
        return self.pixels.size == 0

    def whole(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """Return the picture of (width, height) pixels, with nothing around what it covers."""
        width, height = size
        picture = np.zeros((height, width, 4), np.float32)
        self.put_on(picture, 0, 0)
        return picture

    def put_on(self, picture: NDArray[np.float32], row: int, column: int) -> None:
        """Put its pixels in place of those of a picture whose top left pixel is at (row, column)."""
        height, width, _ = self.pixels.shape
        top, left = self.row - row, self.column - column
        picture[top : top + height, left : left + width] = self.pixels


def cropped(picture: NDArray[np.float32]) -> Cropped:
    """Return a picture, shape (height, width, 4), without the rows and columns around it that show nothing."""
    shows = (picture != 0).any(axis=2)
    rows, columns = np.flatnonzero(shows.any(axis=1)), np.flatnonzero(shows.any(axis=0))
    if not rows.size:
        return Cropped(np.zeros((0, 0, 4), np.float32))
    box = slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
    return Cropped(np.ascontiguousarray(picture[box]), box[0].start, box[1].start)


def over(front: Cropped, behind: Cropped) -> Cropped:
    """Return front + (1 - front.alpha) behind, over what either covers (Porter and Duff 1984)."""
    if front.is_empty or behind.is_empty:
        return behind if front.is_empty else front
    top, left = min(front.row, behind.row), min(front.column, behind.column)
    bottom = max(each.row + each.pixels.shape[0] for each in (front, behind))
    right = max(each.column + each.pixels.shape[1] for each in (front, behind))
    picture = np.zeros((bottom - top, right - left, 4), np.float32)
    behind.put_on(picture, top, left)
    height, width, _ = front.pixels.shape
    part = picture[front.row - top :, front.column - left :][:height, :width]
    part *= 1 - front.pixels[..., 3:]
    part += front.pixels
    return Cropped(picture, top, left)
