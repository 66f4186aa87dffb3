"""Volumes from and to the images of pyvista and VTK (ImageData)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.missing import without_where
from texvol.formats.readers.vtk_xml import GHOSTS, HIDDEN_CELL, HIDDEN_POINT
from texvol.formats.stores.coordinates import EVEN
from texvol.scene.volume import Volume
from texvol.util.arrays import check_is
from texvol.util.errors import InputError, missing_library

_ADVICE = "pyvista's resample, or texvol.load of its file, makes one of other grids"


def from_pyvista(
    image: Any, *, scalars: str | None = None, name: str = "image", labels: bool = False, value_unit: str = ""
) -> Volume:
    """Return the volume of an ImageData, or an even RectilinearGrid, of pyvista or VTK; its samples are not copied.

    Parameters
    ----------
    scalars : str, optional
        Name of the array; the active one by default, or the only one. Values of cells lie in their middles.

    Raises
    ------
    InputError
        If it is another grid or an uneven one, has no such array, or one of several components.
    """
    check_is(image, "an ImageData of pyvista or VTK", "IsA", "GetPointData")
    if image.IsA("vtkRectilinearGrid"):
        image = _even(image, name)
    if not image.IsA("vtkImageData"):
        raise InputError(f"{name}: a volume must be an ImageData, got {image.GetClassName()}; {_ADVICE}")
    values, of_cells = _samples(image, scalars, name)
    extent = np.array(image.GetExtent()).reshape(3, 2)
    is_flat = extent[:, 1] == extent[:, 0]  # cells of a flat image lie in its plane
    counts = extent[:, 1] - extent[:, 0] + (is_flat if of_cells else 1)
    direction = image.GetDirectionMatrix()
    matrix = np.array([[direction.GetElement(row, column) for column in range(3)] for row in range(3)])
    spacing = np.array(image.GetSpacing())
    first = extent[:, 0] + (0.5 * ~is_flat if of_cells else 0.0)
    origin = np.array(image.GetOrigin()) + matrix @ (spacing * first)
    values = values.reshape(counts[::-1])
    return Volume(
        values if labels else _without_hidden(image, values, of_cells), spacing.tolist(), origin.tolist(), matrix,
        name=name, labels=labels, value_unit=value_unit,
    )  # fmt: skip


def _even(grid: Any, name: str) -> Any:
    """Return the ImageData of a rectilinear grid, which has the same arrays."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    spacing, origin = [], []
    for letter, get in zip("xyz", (grid.GetXCoordinates, grid.GetYCoordinates, grid.GetZCoordinates), strict=True):
        positions = vtk_to_numpy(get()).astype(np.float64)
        steps = np.diff(positions)
        mean = float(steps.mean()) if steps.size else 1.0
        if not mean > 0 or np.abs(steps - mean).max(initial=0.0) > EVEN * mean:
            raise InputError(f"{name}: coordinates {letter} of a RectilinearGrid must be even; {_ADVICE}")
        spacing.append(mean)
        origin.append(float(positions[0]))
    image.SetDimensions(grid.GetDimensions())
    image.SetSpacing(spacing)
    image.SetOrigin(origin)
    image.GetPointData().ShallowCopy(grid.GetPointData())
    image.GetCellData().ShallowCopy(grid.GetCellData())
    return image


def to_pyvista(volume: Volume) -> Any:
    """Return the volume as an ImageData of pyvista, with its samples at the points, not copied."""
    try:
        import pyvista
    except ImportError as error:
        raise missing_library("pyvista", "an image of pyvista") from error
    whole = volume.whole
    image = pyvista.ImageData(
        dimensions=whole.dimensions, spacing=whole.spacing, origin=whole.origin, direction_matrix=whole.direction
    )
    values = whole.values.ravel()
    image.point_data[volume.name] = values.astype(np.float32) if values.dtype == np.float16 else values
    return image


def _samples(image: Any, wanted: str | None, name: str) -> tuple[NDArray, bool]:
    """Return the values of an array, in the order of x, y, z, and whether they are of cells."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    parts = (image.GetPointData(), image.GetCellData())
    listed = [(part, part.GetArrayName(number)) for part in parts for number in range(part.GetNumberOfArrays())]
    named = [(part, each) for part, each in listed if each != GHOSTS]
    chosen = [(part, part.GetScalars()) for part in parts if part.GetScalars() is not None]
    if wanted is not None:
        chosen = [(part, part.GetAbstractArray(each)) for part, each in named if each == wanted]
    elif not chosen and len(named) == 1:
        chosen = [(named[0][0], named[0][0].GetAbstractArray(named[0][1]))]
    if not chosen:
        names = ", ".join(each for _, each in named) or "none"
        raise InputError(f"{name}: scalars must name one of its arrays ({names}), got {wanted!r}")
    part, array = chosen[0]
    if not array.IsNumeric():
        raise InputError(f"{name}: the array {array.GetName()} must hold numbers, got {array.GetClassName()}")
    if array.GetNumberOfComponents() != 1:
        count = array.GetNumberOfComponents()
        raise InputError(f"{name}: the array {array.GetName()} must have 1 component, got {count}")
    return vtk_to_numpy(array), part is parts[1]


def _without_hidden(image: Any, values: NDArray, of_cells: bool) -> NDArray:
    """Return the values, with NaN for those of points or cells that VTK hides."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    ghosts = (image.GetCellData() if of_cells else image.GetPointData()).GetArray(GHOSTS)
    if ghosts is None:
        return values
    values.flags.writeable = False  # missing samples are marked in a copy
    hidden = (vtk_to_numpy(ghosts) & (HIDDEN_CELL if of_cells else HIDDEN_POINT) != 0).reshape(values.shape)
    return without_where(values, lambda number, _: hidden[number])[0]
