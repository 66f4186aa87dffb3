"""texvol renders scalar volumes by 3D-texture slicing, and says how far each picture is from the integral.

Names are imported when first used, so that a picture starts in a blink.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from texvol.util.accessor import join_xarray
from texvol.util.version import __version__

if TYPE_CHECKING:
    from texvol import geometry
    from texvol.annotation import Annotation
    from texvol.comparison import Difference, compare
    from texvol.distributed.renderer import DistributedRenderer
    from texvol.distributed.workers import Workers
    from texvol.formats.readers import TimeSeries, load, load_tetrahedra
    from texvol.formats.stores.arrays import open_array
    from texvol.formats.stores.channels import load_channels
    from texvol.options.looks import load_look
    from texvol.output.one_picture import render
    from texvol.output.turn_page.from_python import TurnPage, turn_page
    from texvol.ray_casting import raycast_progressively
    from texvol.ray_casting.tetrahedra import raycast_tetrahedra
    from texvol.rendering.picture import Picture
    from texvol.rendering.renderer import Renderer
    from texvol.rendering.streaming.exact import raycast
    from texvol.rendering.streaming.plan import Plan, plan
    from texvol.rendering.streaming.progressive import render_progressively
    from texvol.scene.added_volume import AddedVolume
    from texvol.scene.camera import Camera
    from texvol.scene.cutting import ClipPlane
    from texvol.scene.depth_picture import DepthPicture
    from texvol.scene.gradient import Estimator
    from texvol.scene.isosurfaces import Isosurface
    from texvol.scene.large_volume import LargeVolume
    from texvol.scene.lighting import DepthCue, Light, Lighting
    from texvol.scene.looks import Look
    from texvol.scene.mask import Mask
    from texvol.scene.measures.measure import Measure
    from texvol.scene.measures.values import measure
    from texvol.scene.scene import Scene
    from texvol.scene.tetrahedra import TetrahedralGrid
    from texvol.scene.transfer import TransferFunction
    from texvol.scene.volume import Volume
    from texvol.util.errors import ContextError, InputError, MissingExtraError, TexvolError
    from texvol.window.remote.notebook import show

# The module of each public name.
_MODULES = {
    "AddedVolume": "scene.added_volume",
    "Annotation": "annotation",
    "Camera": "scene.camera",
    "ClipPlane": "scene.cutting",
    "ContextError": "util.errors",
    "DepthCue": "scene.lighting",
    "DepthPicture": "scene.depth_picture",
    "Difference": "comparison",
    "DistributedRenderer": "distributed.renderer",
    "Estimator": "scene.gradient",
    "InputError": "util.errors",
    "Isosurface": "scene.isosurfaces",
    "LargeVolume": "scene.large_volume",
    "Light": "scene.lighting",
    "Lighting": "scene.lighting",
    "Look": "scene.looks",
    "Mask": "scene.mask",
    "Measure": "scene.measures.measure",
    "MissingExtraError": "util.errors",
    "Picture": "rendering.picture",
    "Plan": "rendering.streaming.plan",
    "Renderer": "rendering.renderer",
    "Scene": "scene.scene",
    "TetrahedralGrid": "scene.tetrahedra",
    "TexvolError": "util.errors",
    "TimeSeries": "formats.readers",
    "TransferFunction": "scene.transfer",
    "TurnPage": "output.turn_page.from_python",
    "Volume": "scene.volume",
    "Workers": "distributed.workers",
    "compare": "comparison",
    "load": "formats.readers",
    "load_channels": "formats.stores.channels",
    "load_look": "options.looks",
    "load_tetrahedra": "formats.readers",
    "measure": "scene.measures.values",
    "open_array": "formats.stores.arrays",
    "plan": "rendering.streaming.plan",
    "raycast": "rendering.streaming.exact",
    "raycast_progressively": "ray_casting",
    "raycast_tetrahedra": "ray_casting.tetrahedra",
    "render": "output.one_picture",
    "render_progressively": "rendering.streaming.progressive",
    "show": "window.remote.notebook",
    "turn_page": "output.turn_page.from_python",
}

__all__ = [
    "AddedVolume",
    "Annotation",
    "Camera",
    "ClipPlane",
    "ContextError",
    "DepthCue",
    "DepthPicture",
    "Difference",
    "DistributedRenderer",
    "Estimator",
    "InputError",
    "Isosurface",
    "LargeVolume",
    "Light",
    "Lighting",
    "Look",
    "Mask",
    "Measure",
    "MissingExtraError",
    "Picture",
    "Plan",
    "Renderer",
    "Scene",
    "TetrahedralGrid",
    "TexvolError",
    "TimeSeries",
    "TransferFunction",
    "TurnPage",
    "Volume",
    "Workers",
    "__version__",
    "compare",
    "geometry",
    "load",
    "load_channels",
    "load_look",
    "load_tetrahedra",
    "measure",
    "open_array",
    "plan",
    "raycast",
    "raycast_progressively",
    "raycast_tetrahedra",
    "render",
    "render_progressively",
    "show",
    "turn_page",
]


def __getattr__(name: str) -> Any:
    if name == "geometry":
        return import_module("texvol.geometry")
    if name not in _MODULES:
        raise AttributeError(f"module 'texvol' has no attribute {name!r}")
    return getattr(import_module(f"texvol.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return __all__


join_xarray()
