"""How far a picture may be from the integral, derived from the samples, the slabs and the formats alone.

Throughout: τ extinction per world unit, d slab thickness, p a ray's path through one slab (d / cosθ, or its whole
chord if that is shorter), L its chord through the box, v its way in index space per world unit, α its opacity. An
error δ of the optical depth changes opacity by (1 - α)(e^δ - 1), and as much the colour of matter of one colour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from texvol.scene import Scene

Numbers = NDArray[np.float64]
ULP = 2.0**-24  # half the distance of float32 numbers in [1, 2): what one rounding of a number up to 1 costs at most
SLABS_PER_BLEND = 32


@dataclass(frozen=True)
class Drawing:
    """What a bound may know: the scene, how it was drawn, and the oracle's picture of it."""

    scene: Scene
    size: tuple[int, int]
    slab_thickness: float
    slabs: int
    truth: Numbers

    @property
    def classification(self) -> str:
        return self.scene.classification


@dataclass(frozen=True)
class Rays:
    """Each pixel's ray: start and way in index space, from where to where (world units), and how it meets the slabs."""

    start: Numbers  # (h, w, 3)
    way: Numbers  # (h, w, 3), per world unit
    enters: Numbers  # (h, w)
    leaves: Numbers
    per_slab: Numbers  # world units between two planes
    first_plane: Numbers  # where plane 0 is met, world units

    @property
    def chord(self) -> Numbers:
        """Length in the box, and in front of the eye."""
        return np.maximum(self.leaves - self.enters, 0)

    @property
    def path(self) -> Numbers:
        """Longest way through one slab."""
        return np.minimum(self.per_slab, self.chord)

    def around(self, s: Numbers) -> tuple[Numbers, Numbers]:
        """How far the planes (or the ends of the chord) before and after the place s are from it."""
        slab = np.floor((s - self.first_plane) / self.per_slab)
        front = np.maximum(self.first_plane + slab * self.per_slab, self.enters)
        back = np.minimum(self.first_plane + (slab + 1) * self.per_slab, self.leaves)
        return s - front, back - s


def rays_of(drawing: Drawing) -> Rays:
    """The rays of a drawing, clipped to the box and to what lies in front of the eye."""
    volume, camera = drawing.scene.volume, drawing.scene.camera_for(drawing.size)
    origins, directions = camera.rays(drawing.size)
    from_centre = origins - volume.centre
    way = directions @ volume.index_from_world.T
    start = from_centre @ volume.index_from_world.T + (np.array(volume.dimensions) - 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-0.5 - start) / way, (np.array(volume.dimensions) - 0.5 - start) / way
    enters, leaves = np.fmin(a, b).max(axis=2), np.fmax(a, b).min(axis=2)
    cosine = directions @ camera.forward
    first_plane = -(from_centre @ camera.forward) / cosine  # plane 0 goes through the middle of the box
    return Rays(start, way, np.maximum(enters, 0), leaves, drawing.slab_thickness / cosine, first_plane)


def extinction_of_samples(scene: Scene) -> Numbers:
    """τ at every sample, shape (nx, ny, nz)."""
    assert scene.transfer_function is not None
    return scene.transfer_function.classify(scene.volume.values).extinction.transpose(2, 1, 0)


def kinks(drawing: Drawing, tau: Numbers, rays: Rays) -> Numbers:
    """Error of the depth (h, w) by the changes of slope where rays meet faces of cells; exact, and signed.

    A change J at a distance a from the nearer plane of its slab: the midpoint rule is off by -J a²/2, the trapezium's
    in each half of the slab by J a (p/2 - a)/2. J is |v| times the second difference of τ; the edge is clamped.
    """
    error = np.zeros(rays.chord.shape)
    for axis, count in enumerate(tau.shape):
        clamped = np.pad(tau, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge")
        second = np.diff(clamped, 2, axis=axis)
        way = rays.way[..., axis]
        for layer in np.flatnonzero(np.moveaxis(second, axis, 0).reshape(count, -1).any(axis=1)):
            s = np.divide(layer - rays.start[..., axis], way, out=np.full(way.shape, np.inf), where=way != 0)
            met = (s > rays.enters) & (s < rays.leaves)
            s = np.where(met, s, 0.0)
            at = np.moveaxis(rays.start + s[..., np.newaxis] * rays.way, 2, 0)
            at[axis] = layer
            change = map_coordinates(second, at, order=1, mode="nearest") * np.abs(way)
            a, b = rays.around(s)
            near, p = np.where(met, np.minimum(a, b), 0.0), np.where(met, a + b, 0.0)
            amount = near * (p / 2 - near) if drawing.classification == "integrated" else -(near**2)
            error += change * amount / 2
    return error


def twist(tau: Numbers, way: Numbers) -> Numbers:
    """Largest second derivative of τ along each ray inside a cell: 2 Σ |v_a v_b τ_ab|, shape (h, w)."""
    bent = np.zeros(way.shape[:2])
    for a, b in ((0, 1), (0, 2), (1, 2)):
        mixed = np.abs(np.diff(np.diff(tau, axis=a), axis=b))
        bent += 2 * np.abs(way[..., a] * way[..., b]) * mixed.max(initial=0.0)
    return bent


def depth_error(drawing: Drawing, tau: Numbers | None = None) -> Numbers:
    """Error of each ray's optical depth at most, (h, w), where τ is trilinear between samples.

    - Changes of slope inside a slab, see `kinks`: up to J p²/8 each.
    - A second derivative f'': p² L f''/24 by the midpoint rule, p² L f''/48 by the trapezium's on half slabs.
    - `slab` interpolates e^-u, u = τ d, instead of u. Trilinear weights are three independent choices, so each axis
      adds at most Δu²/8 to each slab's depth (Hoeffding's lemma; Δu between neighbours).
    """
    tau = extinction_of_samples(drawing.scene) if tau is None else tau
    rays = rays_of(drawing)
    error = np.abs(kinks(drawing, tau, rays))
    error += rays.chord * rays.path**2 * twist(tau, rays.way) / (48 if drawing.classification == "integrated" else 24)
    if drawing.classification == "slab":
        error += rays.chord / drawing.slab_thickness * neighbours_squared(tau * drawing.slab_thickness) / 8
    return error


def neighbours_squared(u: Numbers) -> float:
    """Σ over the axes of the largest squared difference of neighbours."""
    return float(sum((np.diff(u, axis=axis) ** 2).max(initial=0.0) for axis in range(3)))


def opacity_error(drawing: Drawing, depth: Numbers | float) -> float:
    """Largest error of opacity (and of one colour's light) that an error of the depth (h, w) makes."""
    return float(((1 - drawing.truth[..., 3]) * np.expm1(depth)).max())


def rounding(drawing: Drawing, scale: float = 1.0) -> float:
    """What float32 adds to a picture of numbers up to `scale`.

    A blend rounds a product and a sum, each by up to 2^-25 of a picture under 1; they are as good as random, so that
    n blends come to √(2n/3) 2^-25, and the worst of some thousand pixels to five times that. Texel, weights, path and
    series of a slab are relative to its opacity: with one sign, four of the picture's roundings.
    """
    blends = -(-drawing.slabs // SLABS_PER_BLEND) + 1
    return ULP * scale * (5 * np.sqrt(2 * blends / 3) / 2 + 4)


def trilinear(drawing: Drawing) -> float:
    """Bound for one colour and τ trilinear between samples."""
    return opacity_error(drawing, depth_error(drawing)) + rounding(drawing)
