"""Distance, content, topology, size and time of surfaces by every method, on shapes whose surfaces are known.

VTK's filters stand beside texvol's methods where it is installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from benchmark_timing import Run, columns, heading, in_turns, milliseconds, row, seconds_of
from numpy.typing import NDArray

from texvol import Volume
from texvol.geometry import Mesh, Points, enclosed_volume, surface_of
from texvol.geometry.extraction import METHODS
from texvol.geometry.measures import topology_of

_SAMPLES = 32
_SEVERAL = (16, 32, 64)
_PER_SIDE = 4  # parts of a triangle's side; distances are taken in the middle of the small triangles, and at corners
# Off the symmetry of the grid, where samples would lie on the surface.
_PLACE = np.array([0.013, 0.021, -0.017])
Numbers = NDArray[np.float64]
Surface = Mesh | Points


@dataclass(frozen=True)
class Shape:
    """A solid: signed distance of places (…, 3), positive inside; distance of its surface; content; Euler number."""

    inside: Callable[[Numbers], Numbers]
    distance: Callable[[Numbers], Numbers]
    content: float
    euler_number: int


def _balls(radius: float, *centres: tuple[float, float, float]) -> Shape:
    def depths(places: Numbers) -> Numbers:
        return np.stack([radius - np.linalg.norm(places - np.array(centre), axis=-1) for centre in centres])

    content = len(centres) * 4 / 3 * np.pi * radius**3
    # Two that touch are joined in one point.
    euler = 2 * len(centres) - (len(centres) - 1)
    return Shape(lambda p: depths(p).max(axis=0), lambda p: np.abs(depths(p)).min(axis=0), content, euler)


def _torus(ring: float, tube: float) -> Shape:
    def depth(places: Numbers) -> Numbers:
        return np.asarray(tube - np.hypot(np.hypot(places[..., 0], places[..., 1]) - ring, places[..., 2]))

    return Shape(depth, lambda p: np.abs(depth(p)), 2 * np.pi**2 * ring * tube**2, 0)


SHAPES = {
    "sphere": _balls(0.7, (0, 0, 0)),
    "torus": _torus(0.6, 0.25),
    "two spheres that touch": _balls(0.4, (0.24, 0.256, 0.192), (-0.24, -0.256, -0.192)),
}


def sampled(shape: Shape, count: int) -> Volume:
    """The signed distance at count³ samples of the cube from -1 to 1."""
    step = 2 / count
    axis = (np.arange(count) + 0.5) * step - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return Volume(shape.inside(np.stack([x, y, z], axis=-1) - _PLACE), (step,) * 3, (step / 2 - 1,) * 3)


def surfaces(run: Run) -> None:
    """Print the section on surfaces."""
    heading(
        "Surfaces",
        f"{_SAMPLES}³ samples of the distance from each shape. Distances from its surface over the triangles, or of "
        "the points, in spacings; error of the enclosed content; Euler number. Times are medians, made in turns.",
    )
    columns("shape", "method", "mean distance", "largest", "content", "Euler number", "triangles", "ms")
    for name, shape in SHAPES.items():
        volume = sampled(shape, _SAMPLES)
        methods = dict(methods_of(volume))
        times = in_turns(
            {each: lambda make=make: seconds_of(make) for each, make in methods.items()},  # type: ignore[misc]
            run.rounds,
        )
        for each, make in methods.items():
            row(name, each, *cells(make(), shape, volume), milliseconds(times[each]))
    print()
    counts = _SEVERAL[:2] if run.quick else _SEVERAL
    columns("sphere, mean distance (× 1000 of the radius)", *(f"{count}³" for count in counts), "order")
    means: dict[str, list[float]] = {}
    for count in counts:
        volume = sampled(SHAPES["sphere"], count)
        for each, make in methods_of(volume):
            means.setdefault(each, []).append(distances_of(make(), SHAPES["sphere"])[0] / 0.7)
    for each, found in means.items():
        order = np.log2(found[0] / found[-1]) / (len(found) - 1)
        row(each, *(f"{1e3 * mean:.3g}" for mean in found), f"{order:.2f}")


def methods_of(volume: Volume) -> Iterator[tuple[str, Callable[[], Surface]]]:
    """Yield names and calls of texvol's methods, then of VTK's filters."""
    for method in METHODS:
        yield f"`{method}`", lambda method=method: surface_of(volume, 0.0, method)  # type: ignore[misc]
    try:
        import vtkmodules.all  # noqa: F401
    except ImportError:
        return
    for name in ("vtkFlyingEdges3D", "vtkDiscreteFlyingEdges3D", "vtkSurfaceNets3D", "vtkRecursiveDividingCubes"):
        yield name, lambda name=name: by_vtk(volume, name)  # type: ignore[misc]


def by_vtk(volume: Volume, name: str) -> Surface:
    """The surface at 0 by a filter of VTK; labels, where it wants labels, are 1 above and 0 below."""
    from vtkmodules import all as vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    of_labels = "Discrete" in name or "Nets" in name
    values = (volume.values > 0).astype(np.uint8) if of_labels else volume.values
    image = vtk.vtkImageData()
    image.SetDimensions(*volume.dimensions)
    image.SetSpacing(*volume.spacing)
    image.SetOrigin(*volume.origin)
    image.GetPointData().SetScalars(numpy_to_vtk(values.reshape(-1)))
    made: Any = getattr(vtk, name)()
    made.SetInputData(image)
    if "Dividing" in name:
        made.SetValue(0.0)
        made.SetDistance(volume.smallest_spacing / 2 * 1.001)  # parts have to be shorter, not as long
    else:
        made.SetValue(0, 1 if of_labels else 0)
    if "Nets" in name:
        made.SetOutputMeshTypeToTriangles()
    made.Update()
    output = made.GetOutput()
    points = vtk_to_numpy(output.GetPoints().GetData()).astype(np.float64)
    if "Dividing" in name:
        return Points(points, vtk_to_numpy(output.GetPointData().GetNormals()))
    return Mesh(points, vtk_to_numpy(output.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def cells(surface: Surface, shape: Shape, volume: Volume) -> list[str]:
    """Distances, error of the content, Euler number and triangles of a surface, as the table has them."""
    mean, largest = (distance / volume.smallest_spacing for distance in distances_of(surface, shape))
    found = [f"{mean:.3f}", f"{largest:.2f}"]
    if isinstance(surface, Points):
        return [*found, "–", "–", f"{len(surface.points)} points"]
    error = abs(enclosed_volume(surface)) / shape.content - 1
    topology = topology_of(surface)
    euler = f"{topology.euler_number}{'' if topology.is_closed else ', open'}"
    euler += "" if topology.euler_number == shape.euler_number else f" (exact {shape.euler_number})"
    return [*found, f"{100 * error:+.1f} %", euler, str(len(surface.triangles))]


def distances_of(surface: Surface, shape: Shape) -> tuple[float, float]:
    """Mean and largest distance from the shape's surface: over the area of a mesh, or of points."""
    if isinstance(surface, Points):
        distances = shape.distance(surface.points - _PLACE)
        return float(distances.mean()), float(distances.max())
    corners = surface.vertices[surface.triangles] - _PLACE
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sums = ((i + third, j + third) for third in (1 / 3, 2 / 3) for i in range(_PER_SIDE) for j in range(_PER_SIDE))
    weights = np.array([(i, j, _PER_SIDE - i - j) for i, j in sums if i + j < _PER_SIDE]) / _PER_SIDE
    distances = shape.distance(np.einsum("wc,tca->twa", weights, corners))
    largest = max(distances.max(), shape.distance(corners).max())
    return float((distances.mean(axis=1) * areas).sum() / areas.sum()), float(largest)
