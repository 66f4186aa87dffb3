"""States of VTK's objects as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def volume_property_file(folder: Path, color: Any, opacity: Any, unit_distance: float) -> Path:
    """Return the file that VTK's object manager writes of a volume property with these functions."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (VTK's objects need it to be exported)
    from vtkmodules.vtkRenderingCore import vtkVolumeProperty
    from vtkmodules.vtkSerializationManager import vtkObjectManager

    whole, manager = vtkVolumeProperty(), vtkObjectManager()
    whole.SetColor(color)
    whole.SetScalarOpacity(opacity)
    whole.SetScalarOpacityUnitDistance(unit_distance)
    manager.Initialize()
    manager.RegisterObject(whole)
    manager.UpdateStatesFromObjects()
    path = folder / "state.json"  # beside it is a file of arrays
    manager.Export(str(path), 0)
    return path
