"""texvol renders scalar volumes by 3D-texture slicing, and says how far each picture is from the integral.

Names are imported when first used, so that a picture starts in a blink.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from texvol.added_volume import AddedVolume
    from texvol.annotation import Annotation
    from texvol.camera import Camera
    from texvol.comparison import Difference, compare
    from texvol.cutting import ClipPlane
    from texvol.errors import ContextError, InputError, MissingExtraError, TexvolError
    from texvol.gradient import Estimator
    from texvol.lighting import DepthCue, Light, Lighting
    from texvol.mask import Mask
    from texvol.ray_casting import raycast
    from texvol.readers import TimeSeries, load
    from texvol.render import render
    from texvol.renderer import Renderer
    from texvol.scene import Scene
    from texvol.transfer import TransferFunction
    from texvol.volume import Volume

__version__ = "0.4.0"

_HOMES = {
    "AddedVolume": "added_volume",
    "Annotation": "annotation",
    "Camera": "camera",
    "ClipPlane": "cutting",
    "ContextError": "errors",
    "DepthCue": "lighting",
    "Difference": "comparison",
    "Estimator": "gradient",
    "InputError": "errors",
    "Light": "lighting",
    "Lighting": "lighting",
    "Mask": "mask",
    "MissingExtraError": "errors",
    "Renderer": "renderer",
    "Scene": "scene",
    "TexvolError": "errors",
    "TimeSeries": "readers",
    "TransferFunction": "transfer",
    "Volume": "volume",
    "compare": "comparison",
    "load": "readers",
    "raycast": "ray_casting",
    "render": "render",
}

__all__ = [
    "AddedVolume",
    "Annotation",
    "Camera",
    "ClipPlane",
    "ContextError",
    "DepthCue",
    "Difference",
    "Estimator",
    "InputError",
    "Light",
    "Lighting",
    "Mask",
    "MissingExtraError",
    "Renderer",
    "Scene",
    "TexvolError",
    "TimeSeries",
    "TransferFunction",
    "Volume",
    "compare",
    "load",
    "raycast",
    "render",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'texvol' has no attribute {name!r}")
    return getattr(import_module(f"texvol.{_HOMES[name]}"), name)


class _Package(ModuleType):
    def __setattr__(self, name: str, value: Any) -> None:
        # Importing the module texvol.render binds it here, where the function of that name belongs.
        if name == "render" and isinstance(value, ModuleType):
            value = value.render
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
