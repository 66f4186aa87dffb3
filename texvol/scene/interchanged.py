"""Methods of a volume that take it from other libraries, and hand it to them; see `texvol.formats.interchange`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from texvol.util.late import ShownInNotebooks, late


class Interchanged(ShownInNotebooks):
    """Base of `Volume`: from and to xarray, nibabel, SimpleITK, pyvista, arrays and DLPack."""

    if TYPE_CHECKING:
        values: NDArray

    @classmethod
    def from_xarray(cls, array: Any, **told: Any) -> Self:
        """Return the volume of an xarray.DataArray, by the names, coordinates and units of its dimensions.

        Other arguments are those of `texvol.open_array`. Raises InputError if there are no three dimensions of space,
        or coordinates are uneven.
        """
        return cast(Self, late("from_xarray", array, **told))

    @classmethod
    def from_nibabel(cls, image: Any, *, name: str = "image", labels: bool = False, value_unit: str = "") -> Self:
        """Return the volume of an image of nibabel; InputError if it has not three axes."""
        return cast(Self, late("from_nibabel", image, name=name, labels=labels, value_unit=value_unit))

    @classmethod
    def from_sitk(cls, image: Any, *, name: str = "image", labels: bool = False, value_unit: str = "") -> Self:
        """Return the volume of an image of SimpleITK; InputError if it has not three axes, or several components."""
        return cast(Self, late("from_sitk", image, name=name, labels=labels, value_unit=value_unit))

    @classmethod
    def from_pyvista(cls, image: Any, *, scalars: str | None = None, name: str = "image", **told: Any) -> Self:
        """Return the volume of an ImageData of pyvista or VTK, of its array `scalars` or the active one.

        Raises InputError if it is another grid, has no such array, or one of several components.
        """
        return cast(Self, late("from_pyvista", image, scalars=scalars, name=name, **told))

    def to_xarray(self) -> Any:
        """Return an xarray.DataArray of dimensions (z, y, x); InputError if the axes are not those of the world."""
        return late("to_xarray", self)

    def to_nibabel(self) -> Any:
        """Return a Nifti1Image of nibabel, in its world, right, anterior, superior, if the volume says its own."""
        return late("to_nibabel", self)

    def to_sitk(self) -> Any:
        """Return an image of SimpleITK, in the world left, posterior, superior if the volume says its own."""
        return late("to_sitk", self)

    def to_pyvista(self) -> Any:
        """Return an ImageData of pyvista with the samples at its points."""
        return late("to_pyvista", self)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        """Return the samples, shape (nz, ny, nx), read-only unless copied."""
        return np.array(self.values, dtype=dtype, copy=copy)

    def __dlpack__(self, **how: Any) -> Any:
        """Return the samples for `from_dlpack` of another library."""
        return self.values.__dlpack__(**how)

    def __dlpack_device__(self) -> tuple[int, int]:
        """Return DLPack's number of the processor's memory."""
        kind, number = self.values.__dlpack_device__()
        return int(kind), int(number)
