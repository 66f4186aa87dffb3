"""VTI: VTK's image data, a regular grid in XML."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, Samples, grid_from_columns
from texvol.formats.readers.vtk_xml import read_whole


def read(path: str, choice: Choice) -> Samples:
    """Return the samples at the points of an image, or at its cells if only these have values."""
    grid, samples = read_whole(path, "ImageData", choice)
    return samples._replace(**_grid(grid.document.data, grid.extent, grid.at_points))


def _grid(image: Element, extent: list[int], at_points: bool) -> dict[str, Any]:
    origin = _floats(image.get("Origin", "0 0 0"), 3)
    spacing = _floats(image.get("Spacing", "1 1 1"), 3)
    direction = _floats(image.get("Direction", "1 0 0 0 1 0 0 0 1"), 9).reshape(3, 3)
    grid_from_columns(direction)
    first = np.array(extent[::2], dtype=np.float64) + (0.0 if at_points else 0.5)
    return {"spacing": spacing, "direction": direction, "origin": origin + direction @ (spacing * first)}


def _floats(text: str, count: int) -> NDArray[np.float64]:
    numbers = np.array([float(word) for word in text.split()])
    if numbers.size != count:
        raise FileFault(f"must have {count} numbers, got {text!r}")
    return numbers
