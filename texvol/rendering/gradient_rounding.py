"""Estimate of what gradients of 16 bits do to a lit picture, from samples that are seen: nothing is drawn for it.

A pixel's colour is a mean of straight colours along its ray, each between eight samples. Rounding moves these apart
from each other, each as likely up as down. The mean of two is moved by 0.7 times as much as one of them, and of 100,000
pixels hardly one by more than four and a half times that, which is 3.2 times the rms change of the samples around. That
is found in blocks of samples about some that rays meet: once with gradients as they are, once as texels hold them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.visible_rays import visible_rays
from texvol.scene.gradient import Box
from texvol.scene.optics import opacity_from_depth
from texvol.scene.scene import CompleteScene
from texvol.textures.shaded_samples import medium_of_samples
from texvol.textures.value_texture import gradient_step

_RAYS = 24  # along each side of the picture
_MOST_STEPS = 256  # along a ray
_BLOCKS, _SIDE = 32, 6  # blocks with so many samples along a side: their gradients are found at once
_PER_RMS = 3.2


def gradient_rounding(scene: CompleteScene) -> float | None:
    """Estimate the largest change of a picture's colours by gradients that are rounded to 16 bits.

    None where samples do not tell: the medium itself depends on the gradient, it glows without absorbing, there are
    several volumes, or surfaces turn to the eye in light from elsewhere, which jumps where they do.
    """
    medium, lighting = scene.medium, scene.lighting
    if scene.mode != "composite" or lighting is None or scene.added or medium.needs_gradient or medium.glows:
        return None
    if lighting.two_sided and any(light.kind != "head" for light in lighting.lights):
        return None
    step = gradient_step(scene.volume, scene.gradient)
    return _PER_RMS * max((_change(scene, box, step) for box in _seen_blocks(scene)), default=0.0)


def _change(scene: CompleteScene, box: Box, step: float) -> float:
    """Return the rms change of straight colours in a box of samples, weighted by opacity."""
    _, exact = medium_of_samples(scene, None, box)
    _, rounded = medium_of_samples(scene, None, box, step)
    extinction = exact.extinction
    per_color = np.where(np.isfinite(extinction) & (extinction > 0), extinction, 1.0)
    change = np.abs(rounded.emission - exact.emission).max(axis=1, initial=0.0) / per_color
    opacity = opacity_from_depth(extinction * scene.smallest_spacing)
    return float(np.sqrt((opacity * change**2).sum() / max(opacity.sum(), 1e-30)))


def _seen_blocks(scene: CompleteScene) -> list[Box]:
    """Return blocks of samples about those that are seen most along some rays, the more there the more is seen."""
    index, seen = _seen_most(scene)
    if not seen.any():
        return []
    middles = index[np.random.default_rng(0).choice(seen.size, _BLOCKS, p=seen / seen.sum())]
    low = np.clip(middles - _SIDE // 2, 0, np.maximum(np.array(scene.volume.shape) - _SIDE, 0))
    return [(_side(z), _side(y), _side(x)) for z, y, x in np.unique(low, axis=0)]


def _side(first: int) -> slice:
    return slice(int(first), int(first) + _SIDE)


def _seen_most(scene: CompleteScene) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the sample of each ray that is seen most, indices (n, 3) along z, y, x, and what is seen of it, 0 to 1."""
    volume = scene.volume
    eyes, directions = (each.reshape(-1, 3) for each in scene.camera.rays((_RAYS, _RAYS)))
    rays = visible_rays(scene, eyes, directions)
    nearest, directions, first, last = (each[rays.last > rays.first] for each in rays)
    length = last - first
    steps = int(np.clip(np.ceil(length.max(initial=0.0) / scene.smallest_spacing), 1, _MOST_STEPS))
    middles = first[:, np.newaxis] + (np.arange(steps) + 0.5) / steps * length[:, np.newaxis]
    places = nearest[:, np.newaxis] + middles[..., np.newaxis] * directions[:, np.newaxis]
    middle = (np.array(volume.dimensions) - 1) / 2
    index = np.clip(np.rint(places @ volume.index_from_world.T + middle), 0, 2 * middle).astype(np.intp)[..., ::-1]
    extinction = scene.medium.classify(volume.values[tuple(np.moveaxis(index, -1, 0))]).extinction
    opacity = opacity_from_depth(extinction * (length / steps)[:, np.newaxis])
    left = np.cumprod(1 - opacity, axis=1)
    seen = opacity * np.column_stack([np.ones(len(left)), left[:, :-1]])
    most = np.arange(len(seen)), seen.argmax(axis=1)
    return index[most], seen[most]
