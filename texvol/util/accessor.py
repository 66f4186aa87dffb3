"""Accessor of xarray: `array.texvol` draws and shows a DataArray, and makes a volume of it."""

from __future__ import annotations

import sys
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


class _Finder:
    """Finder of modules that has xarray, when it is imported later, registered once it is complete."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the specification of xarray that the other finders have; None for all other modules."""
        if name != "xarray":
            return None
        others = (each.find_spec(name, path, target) for each in sys.meta_path if each is not self)
        spec = next((each for each in others if each is not None), None)
        if spec is not None and spec.loader is not None:
            loader: Any = spec.loader
            execute = loader.exec_module

            def executed(module: Any) -> None:
                execute(module)
                _register(module)

            loader.exec_module = executed
        return spec


def join_xarray() -> None:
    """Give xarray's arrays `.texvol`, whether it is imported already or later; it is not imported for that."""
    if "xarray" in sys.modules:
        _register(sys.modules["xarray"])
    else:
        sys.meta_path.insert(0, _Finder())


def _register(xarray: Any) -> None:
    if hasattr(xarray, "register_dataarray_accessor") and not hasattr(xarray.DataArray, "texvol"):
        xarray.register_dataarray_accessor("texvol")(Accessor)
