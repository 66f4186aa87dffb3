"""VTS: VTK's structured grid, with a world position for each sample, in XML."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from texvol.formats.readers.curvilinear import middles, on_points
from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.formats.readers.vtk_xml import read_whole


def read(path: str, choice: Choice) -> Samples:
    """Return the samples at the points of a grid, or at the middles of its cells if only these have values."""
    grid, samples = read_whole(path, "StructuredGrid", choice)
    points = grid.assembled(map(_points, grid.pieces), 3, at_points=True, what="points")
    if not grid.at_points:
        points = middles(points)
    return on_points(samples.values, points, choice)._replace(notes=samples.notes)


def _points(piece: Element) -> Element:
    array = piece.find("Points/DataArray")
    if array is None:
        raise FileFault(f"its piece of extent {piece.get('Extent')} has no points")
    return array
