"""A volume on a finer grid, for texels that are classified before they are interpolated.

`slab` and `extinction` classify at the samples and interpolate what comes of it, where the medium of `post` is
classified at every point. On a grid of r samples for one, whose values are interpolated first, the two come nearer to
each other: by r² where the transfer function is smooth, by r at its steps. The finer samples fill the same box; sample
k lies at (k + 1/2) / r - 1/2 in the indices of the volume.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.threads import in_threads

Neighbours = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]
REFINEMENTS = (1, 2, 4)  # samples of a texture along an axis for one of the volume
_LAYERS = 8  # made at once: few enough for the cache
_REFINED: WeakKeyDictionary[Volume, dict[int, Volume]] = WeakKeyDictionary()


def refined(volume: Volume, factor: int) -> Volume:
    """Return the volume on a grid that is finer by a factor; the same one for as long as there is the volume."""
    if factor == 1:
        return volume
    known = _REFINED.setdefault(volume, {})
    if factor not in known:
        offset = volume.world_from_index @ np.full(3, 0.5 / factor - 0.5)
        known[factor] = Volume(
            _refined_values(volume.values, factor),
            (volume.spacing / factor).tolist(),
            (volume.origin + offset).tolist(),
            volume.direction,
            unit=volume.unit,
            space=volume.space,
            name=volume.name,
        )
    return known[factor]


def refined_scene(scene: CompleteScene, factor: int) -> CompleteScene:
    """Return the scene with a refined volume; the same object for the same scene and factor.

    Raises
    ------
    InputError
        If the factor is not one of REFINEMENTS, or what is classified is not decided by interpolated values alone.
    """
    if factor not in REFINEMENTS:
        raise InputError(f"texture refinement must be 1, 2, 4 or auto, got {factor!r}")
    if factor == 1:
        return scene
    if beyond := beyond_refinement(scene):
        raise InputError(f"texture refinement {factor} is of a volume classified before interpolation, got {beyond}")
    known: dict[int, CompleteScene] = scene.__dict__.setdefault("_refined", {})
    if factor not in known:
        known[factor] = replace(scene, volume=refined(scene.volume, factor))
    return known[factor]


def beyond_refinement(scene: CompleteScene) -> str:
    """Return what keeps the scene's texture from being refined; an empty text if nothing does."""
    volume = scene.volume
    beyond = {
        f"mode {scene.mode}": scene.mode != "composite",
        f"classification {scene.classification}": scene.classification not in ("slab", "extinction"),
        "several volumes": bool(scene.added),
        "labels": volume.labels,
        "blocks": volume.blocks,
        "colours": volume.colors is not None,
        "light": scene.lighting is not None,
        "matter that depends on the gradient": scene.medium.needs_gradient,
        "a mask": scene.mask is not None,
        "missing values": volume.has_missing,
    }
    return next((name for name, is_there in beyond.items() if is_there), "")


def interpolated(values: NDArray, index: NDArray[np.float64]) -> NDArray[np.float64]:
    """Trilinear interpolation of values (nz, ny, nx) at indices x, y, z, shape (n, 3); beyond its samples a volume
    goes on as it ends."""
    nz, ny, nx = values.shape
    last = np.array((nx, ny, nz)) - 1
    index = np.clip(index, 0, last)
    low = np.minimum(index.astype(np.intp), np.maximum(last - 1, 0))
    fraction = index - low
    to_next = np.where(last > 0, (1, nx, nx * ny), 0)
    start = low @ (1, nx, nx * ny)
    flat = values.reshape(-1)
    found = np.zeros(len(index))
    for corner in range(8):
        bits = corner >> np.arange(3) & 1
        weight = np.where(bits, fraction, 1 - fraction).prod(axis=1)
        found += weight * flat[start + int(bits @ to_next)]
    return found


def _refined_values(values: NDArray, factor: int) -> NDArray:
    """Values on the finer grid; a few layers at a time, so that nothing else is as large."""
    narrow = values.dtype.itemsize <= 2 or values.dtype == np.float32
    wanted = np.empty([factor * count for count in values.shape], np.float32 if narrow else np.float64)
    layers = [slice(z, z + _LAYERS) for z in range(0, len(wanted), _LAYERS)]
    in_threads(partial(_fill, values, factor, wanted), layers)
    return wanted


def _fill(values: NDArray, factor: int, wanted: NDArray, layers: slice) -> None:
    """Interpolate some layers along z, y and x."""
    block = wanted[layers]
    low, high, fraction = _neighbours(np.arange(*layers.indices(len(wanted))), len(values), factor)
    first, last = low[0], high[-1] + 1
    layer = _along(values[first:last].astype(wanted.dtype), 0, (low - first, high - first, fraction))
    for axis in (1, 2):
        layer = _along(layer, axis, _neighbours(np.arange(wanted.shape[axis]), values.shape[axis], factor))
    block[...] = layer


def _neighbours(samples: NDArray[np.intp], count: int, factor: int) -> Neighbours:
    """For samples of the finer grid the samples before and behind in one of `count`, and the fraction between them."""
    place = np.clip((samples + 0.5) / factor - 0.5, 0, count - 1)
    low = np.minimum(place.astype(np.intp), max(count - 2, 0))
    return low, np.minimum(low + 1, count - 1), place - low


def _along(values: NDArray, axis: int, neighbours: Neighbours) -> NDArray:
    """Interpolate along an axis."""
    low, high, fraction = neighbours
    before, behind = values.take(low, axis), values.take(high, axis)
    weight = fraction.astype(values.dtype).reshape([-1 if each == axis else 1 for each in range(3)])
    # In this form equal values stay equal: their differences are 0.
    behind -= before
    behind *= weight
    behind += before
    return behind
