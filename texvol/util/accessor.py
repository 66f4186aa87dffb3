"""Accessor of xarray: `array.texvol` draws and shows a DataArray, and makes a volume of it."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Accessor:
    """Object behind `array.texvol`; xarray keeps it with the array."""

    def __init__(self, array: Any) -> None:
        self._array = array

    def volume(self, **told: Any) -> Any:
        """Return the volume of the array, see `texvol.Volume.from_xarray`."""
        return import_module("texvol").Volume.from_xarray(self._array, **told)

    def render(self, size: Any = None, **how: Any) -> Any:
        """Return the picture of the array, see `texvol.render`."""
        return import_module("texvol").render(self._array, size, **how)

    def show(self, size: Any = None, **how: Any) -> Any:
        """Return a widget that shows the array in a notebook, or its picture, see `texvol.show`."""
        return import_module("texvol").show(self._array, size, **how)
