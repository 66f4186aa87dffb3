"""Translation: the visible layers of napari → a scene of texvol for each, as napari draws them one by one.

It reads layers, camera and dimensions by their public attributes, changes nothing, and knows neither Qt nor OpenGL.

    mip, minip, average    the same extremum or mean along each ray
    iso                    the same surface, under texvol's head light, without highlights
    attenuated_mip         a medium whose extinction is attenuation times the fraction of the contrast limits, a voxel
    translucent            a medium of which a step of napari has the opacity of the colour map
    labels                 opaque labels; lit by the head light in iso_categorical
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import InputError, Lighting, Scene, TransferFunction
from texvol.scene.transfer import label_function
from texvol.util.color import linear_from_srgb
from texvol.util.memory import free_memory
from texvol_napari.placing import camera_of, flips_of, volume_of

NUMBERS = ("mip", "minip", "average")
_MEDIA = ("attenuated_mip", "translucent")
_PART_OF_MEMORY = 0.1  # for the samples of a layer, beside which there are textures and copies
_POINTS = 256  # of a colour map; napari's textures have as many colours
_STEP = 0.8  # napari's step along a ray, in voxels (vispy's relative_step_size)
_OPAQUE = 0.99  # opacity at which napari ends a ray
_LIGHT = Lighting(specular=0.0)  # napari's shading has no highlights
_LIT = "lit by texvol's head light"
_DISCARDING = ("translucent", "translucent_no_depth")  # blendings in which values outside of the limits do not show


class _LeftOutError(Exception):
    """Reason why a layer is not drawn."""


@dataclass(frozen=True)
class Part:
    """One layer: its scene, and how it is blended over the layers below it.

    Parameters
    ----------
    value_range : float
        Difference of the contrast limits, if the picture holds numbers; else 0, and the picture holds colours.
    shown : (low, high)
        Only numbers between these show.
    """

    name: str
    scene: Scene
    opacity: float
    blending: str
    value_range: float = 0.0
    shown: tuple[float, float] = (-np.inf, np.inf)


@dataclass(frozen=True)
class Translation:
    """Parts from the lowest layer to the uppermost, and what differs from napari's picture."""

    parts: tuple[Part, ...]
    remarks: tuple[str, ...]


def translated(layers: Iterable[Any], camera: Any, dims: Any, size: tuple[int, int]) -> Translation:
    """Return the scenes of the visible layers.

    Parameters
    ----------
    layers : iterable of napari.layers.Layer
        From the lowest to the uppermost.
    camera : napari.components.Camera
    dims : napari.components.Dims
        Its `ndisplay`, `displayed` and `point`.
    size : (width, height)
        Of the canvas, in its own pixels.

    Raises
    ------
    InputError
        If napari shows slices, or no visible layer can be drawn.
    """
    if dims.ndisplay != 3:
        raise InputError("napari must show layers in 3D: press the button '2D/3D' below the list of layers")
    displayed = tuple(dims.displayed)
    if displayed != tuple(sorted(displayed)):
        raise InputError(f"the axes that napari shows must be in their own order, got {displayed}")
    parts: list[Part] = []
    remarks: list[str] = []
    look = camera_of(camera, size)
    for layer in layers:
        if not layer.visible:
            continue
        try:
            axes, values, level = _samples(layer, dims)
            make: Callable[..., tuple[Part, list[str]]] = _labels if _is_a(layer, "Labels") else _image
            part, further = make(layer, values, level, axes, flips_of(camera), look)
            further += [f"its level {level} of {len(layer.data)} is drawn"] * layer.multiscale
        except _LeftOutError as error:
            remarks.append(f"layer {layer.name!r} is left out: {error}")
            continue
        parts.append(part)
        remarks += [f"layer {layer.name!r}: {each}" for each in further]
    if not parts:
        raise InputError("; ".join(remarks) or "there must be a visible layer of images or labels, got none")
    if any(each.blending in ("translucent", "opaque") for each in parts[1:]):
        remarks.append("layers cover each other in the order of the list, not by their depth")
    return Translation(tuple(parts), tuple(remarks))


def _is_a(layer: Any, kind: str) -> bool:
    """True if a layer is of a class of napari, which is not imported for that."""
    return any(each.__name__ == kind for each in type(layer).__mro__)


def _samples(layer: Any, dims: Any) -> tuple[tuple[int, ...], NDArray[Any], int]:
    """Return the shown axes (z, y, x) of a layer's data, its samples where the sliders are, and their level."""
    axes = _axes(layer, dims)
    level = _level(layer, axes)
    data = layer.data[level] if layer.multiscale else layer.data
    at = np.asarray(layer.world_to_data(np.asarray(dims.point, np.float64)))
    if layer.multiscale:
        at = at / layer.downsample_factors[level]
    index: list[Any] = [slice(None)] * layer.ndim
    for axis in set(range(layer.ndim)) - set(axes):
        index[axis] = int(np.rint(at[axis]))
        if not 0 <= index[axis] < data.shape[axis]:
            raise _LeftOutError("it has no samples at the sliders' position")
    values = np.asarray(data[tuple(index)])
    return axes, values.astype(np.uint8) if values.dtype == bool else values, level


def _axes(layer: Any, dims: Any) -> tuple[int, ...]:
    """Return the shown axes (z, y, x) of a layer's data; _LeftOutError if the layer can't be drawn."""
    if not (_is_a(layer, "Image") or _is_a(layer, "Labels")):
        raise _LeftOutError(f"it must be of images or labels, got {type(layer).__name__}")
    if getattr(layer, "rgb", False):
        raise _LeftOutError("its samples must be numbers, got colours (rgb)")
    offset = len(dims.point) - layer.ndim  # layers have the last axes of the viewer
    axes = tuple(axis - offset for axis in dims.displayed)
    if len(axes) < 3 or min(axes) < 0:
        raise _LeftOutError(f"it must have the three axes that are shown, has {layer.ndim} axes")
    if str(layer.depiction) != "volume":
        raise _LeftOutError(f"depiction must be volume, got {layer.depiction}")
    if any(plane.enabled for plane in getattr(layer, "experimental_clipping_planes", ())):
        raise _LeftOutError("it must have no clipping planes")
    return axes


def _level(layer: Any, axes: tuple[int, ...]) -> int:
    """Return the number of the finest level that fits into a part of the free memory; napari shows the coarsest."""
    if not layer.multiscale:
        return 0
    room = free_memory() * _PART_OF_MEMORY
    needed = [np.prod([float(data.shape[axis]) for axis in axes]) * data.dtype.itemsize for data in layer.data]
    return next((level for level, count in enumerate(needed) if count <= room), len(needed) - 1)


def _image(layer: Any, values: NDArray[Any], *place: Any) -> tuple[Part, list[str]]:
    """Return the part of an image layer, and what differs."""
    level, axes, flips, look = place
    rendering, blending = str(layer.rendering), str(layer.blending)
    low, high = (float(each) for each in layer.contrast_limits)
    # Between samples only a medium may stay as it is.
    is_nearest = str(layer.interpolation3d) == "nearest" and rendering in _MEDIA
    volume = volume_of(layer, values, axes, flips, level, blocks=is_nearest)
    as_shown = is_nearest or str(layer.interpolation3d) == "linear"
    remarks = [] if as_shown else [f"drawn linear, not {layer.interpolation3d}"]
    more: dict[str, Any] = {}
    if rendering in NUMBERS:
        scene = Scene(volume, _colors(layer), look, mode=rendering, coloring="tf")  # type: ignore[arg-type]
        more["value_range"] = high - low
        if blending in _DISCARDING and rendering != "average":
            more["shown"] = (low, np.inf) if rendering == "mip" else (-np.inf, high)
    elif rendering == "iso":
        surface = {"isovalue": float(layer.iso_threshold), "lighting": _LIGHT}
        scene = Scene(volume, _colors(layer), look, mode="isosurface", **surface)  # type: ignore[arg-type]
        remarks.append(_LIT)
    elif rendering == "attenuated_mip":
        fractions = np.linspace(0, 1, _POINTS)
        scene = Scene(volume, _colors(layer, float(layer.attenuation) * fractions / volume.smallest_spacing), look)
        remarks.append("attenuated_mip is drawn as emission and absorption of the same attenuation")
    elif rendering == "translucent":
        opacities = np.minimum(_map(layer)[:, 3], _OPAQUE)
        scene = Scene(volume, _colors(layer, -np.log1p(-opacities) / (_STEP * volume.smallest_spacing)), look)
        remarks.append("translucent is drawn as a medium with the opacities of napari's steps")
    else:
        known = (*NUMBERS, "iso", "attenuated_mip", "translucent")
        raise _LeftOutError(f"rendering must be one of {', '.join(known)}, got {rendering}")
    return Part(layer.name, scene, float(layer.opacity), blending, **more), remarks


def _map(layer: Any) -> NDArray[np.float64]:
    """Return the colours (sRGB, opacity) of fractions of the contrast limits, gamma applied, shape (n, 4)."""
    fractions = np.linspace(0, 1, _POINTS) ** float(layer.gamma)
    return np.asarray(layer.colormap.map(fractions), np.float64)


def _colors(layer: Any, extinctions: Sequence[float] | NDArray[np.float64] | None = None) -> TransferFunction:
    """Return the colour map as a transfer function; of numbers and surfaces it has the colours only."""
    low, high = (float(each) for each in layer.contrast_limits)
    colors = linear_from_srgb(np.clip(_map(layer)[:, :3], 0, 1))
    given = np.ones(_POINTS) if extinctions is None else np.asarray(extinctions)
    return TransferFunction(np.linspace(low, high, _POINTS), colors, given, name=f"colours of {layer.name}")


def _labels(layer: Any, values: NDArray[Any], *place: Any) -> tuple[Part, list[str]]:
    """Return the part of a layer of labels, and what differs."""
    level, axes, flips, look = place
    volume = volume_of(layer, values, axes, flips, level, labels=True)
    found = np.unique(volume.values).tolist()
    colors, opacities = {}, {}
    for label in found:
        color = layer.get_color(label)
        color = np.zeros(4) if color is None else np.clip(np.asarray(color, np.float64).reshape(-1)[:4], 0, 1)
        opacities[label] = 1.0 if color[3] > 0 else 0.0
        red, green, blue = linear_from_srgb(color[:3]).tolist()
        colors[label] = (red, green, blue)
    if not any(opacities.values()):
        raise _LeftOutError("none of its labels shows")
    is_lit = str(layer.rendering) == "iso_categorical"
    function = label_function(volume, opacities, colors)
    scene = Scene(volume, function, look, lighting=_LIGHT if is_lit else "none")
    part = Part(layer.name, scene, float(layer.opacity), str(layer.blending))
    return part, [_LIT] if is_lit else []
