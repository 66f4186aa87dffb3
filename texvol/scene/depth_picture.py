"""Depth picture: how far each ray sees before something of another renderer hides the rest.

Depths count along the view from the plane of the eye, in world units, as in `texvol render --depth`. What lies behind
is left out, so that the picture over that of the other renderer shows both in one space (z-merging).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays, read_only


@dataclass(frozen=True, eq=False)
class DepthPicture(KeepsArrays):
    """Depths at which the rays of a picture end.

    Parameters
    ----------
    depths : array of shape (height, width)
        World units, row 0 on top; infinite where nothing hides the medium. The array is copied.
    name : str
        Name in messages, usually the file.
    source : mapping
        `path` and `absolute` of the file; empty for an array.

    Raises
    ------
    InputError
        If there are not two axes, or a depth is not a number.
    """

    depths: ArrayLike
    name: str = "depth picture"
    source: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        depths = np.array(self.depths)
        if depths.ndim != 2 or depths.dtype.kind not in "iuf" or not depths.size:
            raise InputError(f"{self.name}: depths must have shape (height, width), got {depths.dtype} {depths.shape}")
        if np.isnan(depths).any():
            raise InputError(f"{self.name}: depths must be numbers, got NaN; infinity is a ray that meets nothing")
        object.__setattr__(self, "depths", read_only(np.ascontiguousarray(depths, np.float64)))

    @property
    def array(self) -> NDArray[np.float64]:
        """The depths, shape (height, width)."""
        assert isinstance(self.depths, np.ndarray)
        return self.depths

    def check_size(self, size: tuple[int, int]) -> None:
        """Raise InputError unless the depths are those of a picture of (width, height) pixels."""
        height, width = self.array.shape
        if size != (width, height):
            raise InputError(
                f"{self.name}: depths must have the size of the picture, {size[0]}x{size[1]}, got {width}x{height}"
            )

    def at_size(self, size: tuple[int, int]) -> NDArray[np.float64]:
        """Return the depths in the pixels of a picture of (width, height) of the same view: the nearest ones."""
        rows, columns = (
            ((np.arange(wanted) + 0.5) * there / wanted).astype(np.intp)
            for wanted, there in zip(size[::-1], self.array.shape, strict=True)
        )
        return self.array[np.ix_(rows, columns)]
