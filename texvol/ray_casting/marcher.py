"""The naive ray caster: many short steps along each ray, in numpy. It says what `raycast` computes.

The light that reaches the eye along a ray is emitted and absorbed by a medium with emission q and extinction τ:

    I = ∫ q(s) T(s) ds + T(s1) B,    T(s) = exp(-∫ τ(s) ds),    opacity = 1 - T(s1)

The marcher takes n steps of length h and evaluates q and τ at the middle of each:

    I ≈ Σ_k q_k T_k h + T_n B,    T_k = exp(-(Σ_{i<k} τ_i h + τ_k h / 2)),    T_n = exp(-Σ_i τ_i h)

In a smooth medium the error falls with h²; a jump of τ by Δ along a ray is misplaced by up to h / 2, and so the optical
depth is wrong by up to Δ h / 2. A scene of several volumes has the sum of their emissions and of their extinctions.

This file holds all of it but the formulas of light (`surface_lighting`): interpolation, classification before or after
it, masks, cuts and the depth cue. Geometry, shadows, caps, opaque media and the projection modes are left to `raycast`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.surface_lighting import reflected
from texvol.scene.camera import Camera
from texvol.scene.gradient import gradients
from texvol.scene.picture_size import checked_size
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]


def march(scene: Scene, size: tuple[int, int], steps: int = 20000) -> Numbers:
    """Return the approximate picture of a scene, shape (height, width, 4): linear, premultiplied, row 0 on top.

    Parameters
    ----------
    size : (width, height)
        In pixels; each takes about 10 ms for each volume.
    steps : int
        Number of steps along each ray.

    Raises
    ------
    InputError
        If the scene has geometry, shadows, caps, an opaque medium, or a mode other than composite.
    """
    width, height = checked_size(size)
    scene = scene.completed(size)
    media = [Medium(each) for each in scene.each_alone()]
    shadows = scene.lighting is not None and scene.lighting.shadows
    opaque = any(np.isinf(medium.transfer.extinctions).any() for medium in media)
    if scene.mode != "composite" or scene.geometry or scene.cutting.caps or shadows or opaque:
        raise InputError("scene must have mode composite and no geometry, caps, shadows or opaque medium to be marched")
    eyes, directions = (each.reshape(-1, 3) for each in scene.camera.rays(size))
    rays = zip(eyes, directions, strict=True)
    return np.array([march_ray(scene, media, *ray, steps) for ray in rays]).reshape(height, width, 4)


def march_ray(scene: CompleteScene, media: list[Medium], eye: Numbers, direction: Numbers, steps: int) -> Numbers:
    """Return colour and opacity (4) of one ray, by the midpoint rule."""
    box = scene.box
    middle = float((box.centre - eye) @ direction)
    first = max(middle - box.radius, 0.0)
    h = (middle + box.radius - first) / steps
    positions = eye + (first + (np.arange(steps) + 0.5) * h)[:, np.newaxis] * direction
    glow = np.sum([medium.at(positions) for medium in media], axis=0)
    glow = cued(scene, positions, glow) * kept(scene, positions)[:, np.newaxis]
    q, tau = glow[:, :3], glow[:, 3]
    depth = np.cumsum(tau) * h
    transmittance = np.exp(-(depth - tau * h / 2))
    behind = np.exp(-depth[-1])
    color = (q * transmittance[:, np.newaxis]).sum(axis=0) * h + behind * np.array(scene.background)
    return np.append(color, -np.expm1(-depth[-1]))


class Medium:
    """The medium of one volume: interpolated and classified in the order that the scene asks for."""

    def __init__(self, scene: CompleteScene) -> None:
        self.scene, self.volume, self.transfer = scene, scene.volume, scene.medium
        self.values = self.volume.values.astype(np.float64)
        shape = self.values.shape
        self.weights = np.ones(shape) if scene.mask is None else scene.mask.array.astype(np.float64)
        self.slopes = np.zeros((*shape, 3))  # gradients, data units per smallest spacing
        if scene.needs_gradient:
            self.slopes = gradients(self.volume, scene.gradient).astype(np.float64)
        before = scene.classification in ("slab", "extinction") or self.volume.colors is not None
        self.samples = self._classified_samples() if before and not self.volume.nearest else None

    def at(self, positions: Numbers) -> Numbers:
        """Return emission and extinction (n, 4): 0 outside the box, which ends half a sample beyond the samples."""
        volume = self.volume
        index = (positions - volume.origin) @ volume.index_from_world.T
        inside = ((index > -0.5) & (index < np.array(volume.dimensions) - 0.5)).all(axis=1)
        glow = np.zeros((len(positions), 4))
        glow[inside] = self._at(index[inside], positions[inside])
        return glow

    def _at(self, index: Numbers, positions: Numbers) -> Numbers:
        if self.volume.nearest:  # the nearest sample counts
            x, y, z = np.clip(np.floor(index + 0.5).astype(int), 0, np.array(self.volume.dimensions) - 1).T
            glow = self._classified(self.values[z, y, x], self.slopes[z, y, x], positions)
            return self.weights[z, y, x, np.newaxis] * glow
        if self.samples is not None:  # classified, then interpolated
            return interpolated(self.samples, index)
        glow = self._classified(interpolated(self.values, index), interpolated(self.slopes, index), positions)
        return interpolated(self.weights, index)[:, np.newaxis] * glow

    def _classified_samples(self) -> Numbers:
        """Return emission and extinction of all samples, (z, y, x, 4), multiplied by their mask weights and colours."""
        shape = self.values.shape
        k, j, i = np.indices(shape).reshape(3, -1)
        positions = self.volume.origin + np.stack([i, j, k], axis=1) @ self.volume.world_from_index.T
        glow = self._classified(self.values.reshape(-1), self.slopes.reshape(-1, 3), positions, self.volume.colors)
        return self.weights[..., np.newaxis] * glow.reshape(*shape, 4)

    def _classified(
        self, values: Numbers, slopes: Numbers, positions: Numbers, colors: NDArray | None = None
    ) -> Numbers:
        """Return lit emission and extinction (n, 4) of values with gradients at positions."""
        magnitudes = np.linalg.norm(slopes, axis=1) / self.volume.smallest_spacing
        q, tau = self.transfer.classify(values, magnitudes if self.transfer.needs_gradient else None)
        if colors is not None:
            q = q * colors.reshape(-1, 3)
        if self.scene.lighting is not None:
            to_eye = toward_eye(self.scene.camera, positions)
            from_centre = positions - self.volume.centre
            diffuse, specular = reflected(self.scene.lighting, self.volume, slopes, from_centre, to_eye)
            q = q * diffuse + tau[:, np.newaxis] * specular
        return np.column_stack([q, tau])


def interpolated(samples: Numbers, index: Numbers) -> Numbers:
    """Return the trilinear mean of samples (z, y, x, …) at `index` (n, 3) in x, y, z; edge samples are repeated."""
    last = np.array(samples.shape[2::-1]) - 1
    index = np.clip(index, 0, last)
    low = np.minimum(np.floor(index).astype(int), np.maximum(last - 1, 0))
    total = np.zeros((len(index), *samples.shape[3:]))
    for corner in range(8):
        far = (corner >> np.arange(3)) & 1
        weight = np.where(far, index - low, 1 - (index - low)).prod(axis=1)
        x, y, z = np.minimum(low + far, last).T
        total += weight.reshape(-1, *[1] * (samples.ndim - 3)) * samples[z, y, x]
    return total


def toward_eye(camera: Camera, positions: Numbers) -> Numbers:
    """Return the unit vectors (n, 3) from positions to the eye."""
    if camera.projection == "orthographic":
        return np.broadcast_to(-camera.forward, positions.shape)
    vectors = np.array(camera.eye) - positions
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def cued(scene: CompleteScene, positions: Numbers, glow: Numbers) -> Numbers:
    """Return emission and extinction (n, 4) with the depth cue of the scene: q becomes q (1 - t) + τ t color."""
    cue = scene.depth_cue
    if cue is None:
        return glow
    near, far = cue.range_for(scene.box, scene.camera)
    depth = (positions - np.array(scene.camera.eye)) @ scene.camera.forward
    t = cue.strength * np.clip((depth - near) / (far - near), 0, 1)[:, np.newaxis]
    q, tau = glow[:, :3], glow[:, 3:]
    return np.concatenate([q * (1 - t) + tau * t * np.array(cue.color), tau], axis=1)


def kept(scene: Scene, positions: Numbers) -> NDArray[np.bool_]:
    """Return True for each position that clip planes and crop box keep."""
    inside = np.ones(len(positions), np.bool_)
    for plane in scene.clip:
        inside &= positions @ np.array(plane.normal) >= plane.offset
    for axis, (low, high) in enumerate(scene.crop or ()):
        inside &= (positions[:, axis] >= low) & (positions[:, axis] <= high)
    return inside
