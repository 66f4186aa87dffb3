"""Some pixels of a plain scene by small steps in float64, in numpy: slower than the oracle, and there at once.

The oracle takes a second to load and longer to compile. Where a picture's error is to be checked in passing, a few rays
are marched here: values are interpolated at the middles of many short steps, classified, and composited from the front,

    I = Σ T_k q_k (1 - exp(-τ_k h)) / τ_k,    T_k = exp(-Σ_{i<k} τ_i h)

Every other step alone, once the even and once the odd ones, gives two pictures that differ by more than this one is
off. Nothing of it is shared with what draws.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.value_storage import bulk_of

Numbers = NDArray[np.float64]
_STEPS = 2048  # along each ray; together with the rays that are asked for some 50 ms
_STEPS_BETWEEN = 2.0  # between two control points, where the value goes through most of its range in a voxel
_STEPS_BEFORE = 512  # where eight samples are classified for each step


def can_march(scene: CompleteScene) -> bool:
    """True for one volume of finite values and a plain medium of finite extinction without narrow spikes."""
    volume, transfer_function = scene.volume, scene.medium
    if scene.mode != "composite" or scene.added or scene.geometry or scene.mask is not None or scene.cutting.caps:
        return False
    if scene.lighting is not None or scene.depth_cue is not None or transfer_function.needs_gradient:
        return False
    if volume.labels or volume.colors is not None or volume.value_range is None:
        return False
    if volume.has_missing or not np.isfinite(volume.value_range).all():
        return False
    return bool(np.isfinite(transfer_function.extinctions).all()) and not _may_pass_over(scene)


def _may_pass_over(scene: CompleteScene) -> bool:
    """True if the value may go through all that lies between two control points within a step."""
    if scene.classification in ("slab", "extinction"):
        return False
    low, high = bulk_of(scene.volume)
    voxels = float(np.linalg.norm(scene.volume.dimensions)) / _STEPS
    gaps = np.diff(scene.medium.values)
    return bool(gaps[gaps > 0].min(initial=np.inf) < _STEPS_BETWEEN * voxels * (high - low))


def march_pixels(scene: CompleteScene, size: tuple[int, int], pixels: NDArray[np.intp]) -> tuple[Numbers, Numbers]:
    """Pixels of the linear picture over its background, shape (n, 4), and how far off each may be, shape (n,).

    Parameters
    ----------
    pixels : array of shape (n, 2)
        Column and row of each, from the top left.
    """
    columns, rows = pixels.T
    eyes, directions = (each[rows, columns] for each in scene.camera.rays(size))
    volume = scene.volume
    from_centre = eyes - volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    nearest = from_centre - eye[:, np.newaxis] * directions
    first, last = scene.cutting.interval(volume, nearest, directions)
    first, last = np.maximum(np.maximum(first, eye), -volume.radius), np.minimum(last, volume.radius)
    length = np.maximum(last - first, 0.0)
    before = scene.classification in ("slab", "extinction")
    steps = _STEPS_BEFORE if before else _STEPS
    middles = first[:, np.newaxis] + (np.arange(steps) + 0.5) / steps * length[:, np.newaxis]
    positions = nearest[:, np.newaxis] + middles[..., np.newaxis] * directions[:, np.newaxis]
    q, tau = _medium(volume, scene.medium, positions.reshape(-1, 3), before)
    q, tau = q.reshape(len(pixels), steps, 3), tau.reshape(len(pixels), steps)
    fine = _composited(q, tau, length / steps, scene.background)
    even, odd = (_composited(q[:, i::2], tau[:, i::2], 2 * length / steps, scene.background) for i in (0, 1))
    return fine, np.abs(even - odd).max(axis=1)


def _medium(
    volume: Volume, transfer_function: TransferFunction, positions: Numbers, before: bool
) -> tuple[Numbers, Numbers]:
    """Emission (n, 3) and extinction (n) at positions from the middle of the box, world units; 0 outside."""
    last = np.array(volume.dimensions) - 1
    index = positions @ volume.index_from_world.T + 0.5 * last
    outside = np.any((index < -0.5) | (index > last + 0.5), axis=1)
    index = np.clip(index, 0, last)
    low = np.minimum(index.astype(np.intp), np.maximum(last - 1, 0))
    fraction = index - low
    value, q, tau = np.zeros(len(positions)), np.zeros((len(positions), 3)), np.zeros(len(positions))
    for corner in range(8):
        far = corner >> np.arange(3) & 1
        weight = np.where(far, fraction, 1 - fraction).prod(axis=1)
        x, y, z = np.minimum(low + far, last).T
        samples = volume.values[z, y, x].astype(np.float64)
        if before:
            emission, extinction = transfer_function.classify(samples)
            q += weight[:, np.newaxis] * emission
            tau += weight * extinction
        else:
            value += weight * samples
    if not before:
        q, tau = transfer_function.classify(value)
    return np.where(outside[:, np.newaxis], 0.0, q), np.where(outside, 0.0, tau)


def _composited(q: Numbers, tau: Numbers, step: Numbers, background: tuple[float, float, float]) -> Numbers:
    """Premultiplied colour over the background, and opacity, of rays of steps, shape (n, 4)."""
    depth = tau * step[:, np.newaxis]
    behind = np.cumsum(depth, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(depth > 1e-8, -np.expm1(-depth) / depth, 1.0)
    seen = np.exp(-(behind - depth)) * mean * step[:, np.newaxis]
    left = np.exp(-behind[:, -1])
    color = (q * seen[..., np.newaxis]).sum(axis=1) + left[:, np.newaxis] * np.array(background)
    return np.column_stack([color, -np.expm1(-behind[:, -1])])
