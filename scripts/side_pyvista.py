"""pyvista's `Plotter.add_volume`: VTK's mappers through a look-up table of 8 bits.

What differs from VTK is said by `about`. The samples are padded and cropped, as `vtk_process` does for VTK's
fixed-point mapper: pyvista turns cells into averages at their corners.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
from numpy.typing import NDArray
from pyvista.plotting.mapper import FixedPointVolumeRayCastMapper, GPUVolumeRayCastMapper
from side_given import Array, Given, Medium
from vtkmodules.vtkCommonDataModel import vtkPlane
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper, vtkGPUVolumeRayCastMapper

# pyvista's class of each mapper, and VTK's.
_MAPPERS = {
    "gpu": (GPUVolumeRayCastMapper, vtkGPUVolumeRayCastMapper),
    "fixed_point": (FixedPointVolumeRayCastMapper, vtkFixedPointVolumeRayCastMapper),
}


class Program:
    """A plotter for each mapper, with one volume."""

    def __init__(self, given: Given) -> None:
        self._given = given
        self._plotters: dict[str, tuple[pyvista.Plotter, pyvista.Volume]] = {}
        version = ".".join(map(str, pyvista.vtk_version_info))
        same = all(issubclass(own, of_vtk) for own, of_vtk in _MAPPERS.values())
        self.about = f"its mappers are {'those' if same else 'not those'} of VTK {version}"

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""
        for plotter, _ in self._plotters.values():
            plotter.close()
        self._plotters, self._medium = {}, medium

    def draw(self, family: str, rate: float) -> NDArray[np.float32]:
        """Return the picture by one of the mappers, of 8 bits."""
        if family not in self._plotters:
            self._plotters[family] = self._made(family)
        plotter, volume = self._plotters[family]
        volume.mapper.SetSampleDistance(1 / rate)
        plotter.camera.Modified()
        plotter.render()
        picture = plotter.screenshot(return_img=True, transparent_background=True)
        return np.asarray(picture, np.float32) / np.float32(255)

    def _made(self, family: str) -> tuple[pyvista.Plotter, pyvista.Volume]:
        given, medium = self._given, self._medium
        samples = np.pad(given.values, 1, mode="edge")
        grid = pyvista.ImageData(dimensions=samples.shape[::-1], spacing=given.spacing, origin=-given.spacing / 2)
        grid.point_data["values"] = samples.reshape(-1)
        plotter = pyvista.Plotter(off_screen=True, window_size=list(given.size), lighting="none")
        plotter.background_color = "black"  # what is drawn is premultiplied
        volume = plotter.add_volume(
            grid,
            cmap=lookup_table(medium),
            clim=(medium.low, medium.high),
            mapper=family,
            opacity_unit_distance=medium.path_for_bits,
            show_scalar_bar=False,
        )
        volume.prop.interpolation_type = "linear"
        mapper = volume.mapper
        mapper.AutoAdjustSampleDistancesOff()
        mapper.LockSampleDistanceToInputSpacingOff()
        _cut(mapper, family, given)
        _aim(plotter, given)
        return plotter, volume


def lookup_table(medium: Medium) -> pyvista.LookupTable:
    """Return colours and opacities as pyvista's table, opacities of a path that suits 8 bits."""
    table = pyvista.LookupTable(scalar_range=(medium.low, medium.high))
    colors = np.column_stack([medium.colors, medium.opacities(medium.path_for_bits)])
    table.values = np.rint(255 * colors).astype(np.uint8)
    return table


def _cut(mapper: Any, family: str, given: Given) -> None:
    """Let a mapper end at the box; the one for graphics cards would crop half a voxel too late."""
    if family == "fixed_point":
        mapper.CroppingOn()
        mapper.SetCroppingRegionFlagsToSubVolume()
        mapper.SetCroppingRegionPlanes(*(end for far in given.box for end in (0, far)))
        return
    for axis, far in enumerate(given.box):
        for place, sign in ((0.0, 1.0), (far, -1.0)):
            normal, origin = np.zeros(3), np.zeros(3)
            normal[axis], origin[axis] = sign, place
            mapper.AddClippingPlane(_plane(origin, normal))


def _plane(origin: Array, normal: Array) -> vtkPlane:
    plane = vtkPlane()
    plane.SetOrigin(origin.tolist())
    plane.SetNormal(normal.tolist())
    return plane


def _aim(plotter: pyvista.Plotter, given: Given) -> None:
    told, camera = given.camera, plotter.camera
    camera.position, camera.focal_point, camera.up = told["eye"], told["target"], told["up"]
    if told["projection"] == "orthographic":
        camera.parallel_projection, camera.parallel_scale = True, told["height"] / 2
    else:
        camera.view_angle = told["fov"]
    camera.clipping_range = told["range"]
