"""VTI: VTK's image data in XML, read by VTK's own reader, of which only the part for XML files is imported.

VTK prints on stderr what goes wrong and carries on; here that is caught and becomes an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from texvol.readers.samples import Choice, FileFault, Samples, check_size, grid_from_columns, pick, real_type


def read(path: str, choice: Choice) -> Samples:
    """Samples at the points of an image, or at its cells if only these have values."""
    from vtkmodules.util.numpy_support import get_numpy_array_type, vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    with _caught_errors() as errors:
        reader = vtkXMLImageDataReader()
        reader.SetFileName(path)
        reader.UpdateInformation()
        _raise_first(errors)
        extent = reader.GetOutputInformation(0).Get(_extent_key())
        points = [int(extent[2 * axis + 1]) - int(extent[2 * axis]) + 1 for axis in range(3)]
        at_points = reader.GetNumberOfPointArrays() > 0
        sizes = points if at_points else [size - 1 for size in points]
        check_size(sizes, 1)
        reader.Update()
        _raise_first(errors)
        image = reader.GetOutput()
    array = _array(image.GetPointData() if at_points else image.GetCellData())
    real_type(np.dtype(get_numpy_array_type(array.GetDataType())))
    components = array.GetNumberOfComponents()
    if array.GetNumberOfTuples() != sizes[0] * sizes[1] * sizes[2]:
        raise FileFault(f"its array {array.GetName()!r} has {array.GetNumberOfTuples()} samples for {sizes} points")
    values = vtk_to_numpy(array).reshape([*sizes[::-1], components])
    values = values[pick("ZYXC", values.shape, choice)]
    return Samples(values, **_grid(image, extent, at_points))


def _extent_key() -> Any:
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    return vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()


def _array(data: Any) -> Any:
    """The array marked as scalars, or the only one there is."""
    names = [data.GetArrayName(number) for number in range(data.GetNumberOfArrays())]
    array = data.GetScalars()
    if array is None and len(names) == 1:
        array = data.GetArray(0)
    if array is None:
        raise FileFault(f"has no array of numbers marked as Scalars; it has {', '.join(map(str, names)) or 'none'}")
    return array


def _grid(image: Any, extent: Any, at_points: bool) -> dict[str, Any]:
    matrix = image.GetDirectionMatrix()
    columns = np.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])
    _, direction = grid_from_columns(columns)
    spacing = np.array(image.GetSpacing())
    first = np.array(extent[::2], dtype=np.float64) + (0.0 if at_points else 0.5)
    return {"spacing": spacing, "direction": columns, "origin": image.GetOrigin() + columns @ (spacing * first)}


@contextmanager
def _caught_errors() -> Iterator[Any]:
    """VTK's output window, replaced by one that keeps the text."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    window = vtkOutputWindow.GetInstance()
    caught = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(caught)
    try:
        yield caught
    finally:
        vtkOutputWindow.SetInstance(window)


def _raise_first(errors: Any) -> None:
    text = errors.GetOutput().strip()
    if text:
        # Lines of a message are "ERROR: In file, line n", then "class (address): reason".
        lines = [line for line in text.splitlines() if line.strip() and not line.startswith(("ERROR", "Warning"))]
        raise FileFault(f"cannot be read as VTI: {(lines or [text])[0].partition('): ')[2] or text}")
