"""Volumes from and to the objects of other libraries, with where their samples lie and in which unit.

Nothing is resampled or silently transposed: what a volume cannot say is an error.
"""

from __future__ import annotations

from texvol.formats.interchange.anything import volume_of
from texvol.formats.interchange.medical import from_nibabel, from_sitk, to_nibabel, to_sitk
from texvol.formats.interchange.named import from_xarray, to_xarray
from texvol.formats.interchange.vtk_images import from_pyvista, to_pyvista

__all__ = [
    "from_nibabel",
    "from_pyvista",
    "from_sitk",
    "from_xarray",
    "to_nibabel",
    "to_pyvista",
    "to_sitk",
    "to_xarray",
    "volume_of",
]
