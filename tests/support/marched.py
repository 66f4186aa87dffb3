"""Pictures by brute force: many short steps along each ray, in numpy; shares nothing with the compiled oracle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.projection_shading import answer
from texvol.scene.gradient import gradients
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]


def interpolated(samples: NDArray, index: Numbers) -> Numbers:
    """Trilinear between samples (z, y, x, …), those at the edge repeated beyond it, at index (n, 3) in x, y, z."""
    most = np.array(samples.shape[2::-1]) - 1
    position = np.clip(index, 0, most)
    low = np.minimum(np.floor(position).astype(int), np.maximum(most - 1, 0))
    total = np.zeros((len(index), *samples.shape[3:]))
    for corner in range(8):
        far = (corner >> np.arange(3)) & 1
        weight = np.where(far, position - low, 1 - (position - low)).prod(axis=1)
        x, y, z = np.minimum(low + far, most).T
        found = np.where(weight.reshape(-1, *[1] * (samples.ndim - 3)) > 0, samples[z, y, x], 0)
        total += weight.reshape(-1, *[1] * (samples.ndim - 3)) * found
    return total


def medium(
    scene: Scene,
    volume: Volume,
    transfer: TransferFunction,
    mask: Mask | None,
    positions: Numbers,
    to_eye: Numbers,
    eye: Numbers | None,
):
    """Emission (n, 3) and extinction (n) of one volume at places of the world; `eye`: where all rays of a view meet."""
    index = (positions - volume.origin) @ np.linalg.inv(volume.direction * volume.spacing).T
    size = np.array(volume.dimensions)
    inside = ((index > -0.5) & (index < size - 0.5)).all(axis=1)
    weights = np.ones(volume.values.shape) if mask is None else mask.array.astype(float)
    emission, extinction = np.zeros((len(positions), 3)), np.zeros(len(positions))
    at, v = index[inside], positions[inside] - volume.centre
    if volume.labels:
        x, y, z = np.clip(np.floor(at + 0.5).astype(int), 0, size - 1).T
        slopes = gradients(volume, scene.gradient).astype(float)[z, y, x]
        q, tau = lit(scene, volume, transfer, volume.values[z, y, x], slopes, v, to_eye[inside])
        emission[inside], extinction[inside] = weights[z, y, x][:, None] * q, weights[z, y, x] * tau
        return emission, extinction
    before = scene.classification in ("slab", "extinction") or volume.colors is not None
    if before:
        glow = of_samples(scene, volume, transfer, weights, to_eye, eye)
        found = interpolated(glow, at)
        emission[inside], extinction[inside] = found[:, :3], found[:, 3]
        return emission, extinction
    values, weight = interpolated(volume.values.astype(float), at), interpolated(weights, at)
    slopes = interpolated(gradients(volume, scene.gradient).astype(float), at)
    q, tau = lit(scene, volume, transfer, values, slopes, v, to_eye[inside])
    emission[inside], extinction[inside] = weight[:, None] * q, weight * tau
    return emission, extinction


def of_samples(
    scene: Scene, volume: Volume, transfer: TransferFunction, weights: Numbers, to_eye: Numbers, eye: Numbers | None
) -> Numbers:
    """Emission and extinction of all samples, (z, y, x, 4)."""
    k, j, i = np.indices(volume.values.shape)
    index = np.stack([i, j, k], axis=-1).reshape(-1, 3)
    positions = volume.origin + index @ (volume.direction * volume.spacing).T
    if eye is None:
        toward = np.broadcast_to(to_eye[0], positions.shape)
    else:
        toward = (eye - positions) / np.linalg.norm(eye - positions, axis=1, keepdims=True)
    slopes = gradients(volume, scene.gradient).astype(float).reshape(-1, 3)
    tint = None if volume.colors is None else volume.colors.reshape(-1, 3)
    q, tau = lit(scene, volume, transfer, volume.values.reshape(-1), slopes, positions - volume.centre, toward, tint)
    return np.concatenate([q, tau[:, None]], axis=1).reshape(*volume.values.shape, 4) * weights[..., None]


def lit(
    scene: Scene,
    volume: Volume,
    transfer: TransferFunction,
    values: NDArray,
    slopes: Numbers,
    from_centre: Numbers,
    to_eye: Numbers,
    tint: NDArray | None = None,
):
    """Emission and extinction of values with gradients, in the light."""
    magnitudes = np.linalg.norm(slopes, axis=1) / volume.smallest_spacing
    q, tau = transfer.classify(values, magnitudes if transfer.needs_gradient else None)
    if tint is not None:
        q = q * tint
    if scene.lighting is not None:
        diffuse, specular = answer(scene.lighting, volume, slopes, from_centre, to_eye)
        q = q * diffuse + tau[:, None] * specular
    return q, tau


def marched(scene: Scene, size: tuple[int, int], steps: int = 20000) -> Numbers:
    """Picture by the midpoint rule; the transfer functions have to be given, and nothing is opaque."""
    camera = scene.completed(size).camera
    eyes, directions = (each.reshape(-1, 3) for each in camera.rays(size))
    box, picture = scene.box, np.zeros((len(eyes), 4))
    cue = scene.depth_cue
    near, far = (0.0, 1.0) if cue is None else cue.range_for(box, camera)
    parts = [(scene.volume, scene.transfer_function, scene.mask)]
    parts += [(each.volume, each.transfer_function, each.mask) for each in scene.added]
    for ray, (eye, direction) in enumerate(zip(eyes, directions, strict=True)):
        middle = (box.centre - eye) @ direction
        start = max(middle - box.radius, 0.0)
        step = (middle + box.radius - start) / steps
        s = start + (np.arange(steps) + 0.5) * step
        positions = eye + s[:, None] * direction
        to_eye = np.broadcast_to(-direction, positions.shape)
        point = np.array(camera.eye) if camera.projection == "perspective" else None
        found = [medium(scene, v, t, m, positions, to_eye, point) for v, t, m in parts]
        q, tau = sum(each[0] for each in found), sum(each[1] for each in found)
        kept = np.ones(steps, bool)
        for plane in scene.clip:
            kept &= positions @ np.array(plane.normal) >= plane.offset
        for axis, (low, high) in enumerate(scene.crop or ()):
            kept &= (positions[:, axis] >= low) & (positions[:, axis] <= high)
        if cue is not None:
            depth = (positions - np.array(camera.eye)) @ camera.forward
            fraction = cue.strength * np.clip((depth - near) / (far - near), 0, 1)[:, None]
            q = q * (1 - fraction) + tau[:, None] * fraction * np.array(cue.color)
        q, tau = q * kept[:, None], tau * kept
        depth = np.cumsum(tau) * step
        left = np.exp(-(depth - tau * step / 2))
        picture[ray, :3] = (q * left[:, None]).sum(axis=0) * step + np.exp(-depth[-1]) * np.array(scene.background)
        picture[ray, 3] = -np.expm1(-depth[-1])
    return picture.reshape(size[1], size[0], 4)
