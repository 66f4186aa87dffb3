"""Functions of higher layers that methods of lower ones stand for.

`volume.to_xarray()` and what a notebook shows of a scene are methods of the scene's classes, since that is where people
look for them, while the code needs readers, renderer and options, which are built on those classes. Such a method names
its function here, and the function's module is imported when it is called.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

# Modules by what they give; tests hold each name against the module.
_FUNCTIONS = {
    "card": "output.cards",
    "from_nibabel": "formats.interchange",
    "from_pyvista": "formats.interchange",
    "from_sitk": "formats.interchange",
    "from_xarray": "formats.interchange",
    "load_scene": "options.scene_of_file",
    "preset": "scene.transfer.presets",
    "save_transfer_function": "scene.transfer.saving",
    "to_nibabel": "formats.interchange",
    "to_pyvista": "formats.interchange",
    "to_sitk": "formats.interchange",
    "to_xarray": "formats.interchange",
    "write_scene": "window.scene_writing",
}


def late(function: str, *arguments: Any, **named: Any) -> Any:
    """Import the module of a function of a higher layer, and call the function."""
    return getattr(import_module(f"texvol.{_FUNCTIONS[function]}"), function)(*arguments, **named)


class ShownInNotebooks:
    """Base of classes of which a notebook shows a small card."""

    def _repr_html_(self) -> str:
        """Return the card, HTML."""
        return str(late("card", self))
