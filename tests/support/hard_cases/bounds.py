"""How far a picture may be from the integral, derived from the samples, the slabs and the formats alone.

Throughout: τ extinction per world unit, d slab thickness, p a ray's path through one slab (d / cosθ, or its whole
chord if that is shorter), L its chord through the box, v its way in index space per world unit, α its opacity. An
error δ of the optical depth changes opacity by (1 - α)(e^δ - 1), and as much the colour of matter of one colour.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.slicing.slabs import SLABS_PER_STACK, Slicing

Numbers = NDArray[np.float64]
ULP = 2.0**-24  # half the distance of float32 numbers in [1, 2): what one rounding of a number up to 1 costs at most
SLABS_PER_RUN = 64  # composited by themselves, before they are put behind what is in front of them
# The table of `post` and `integrated` keeps a transfer function's points this share of themselves to the left, so that
# rounding takes no flat field to the left of a step.
EARLY_POINTS = 2.0**-22


@dataclass(frozen=True)
class Drawing:
    """What a bound may know: the scene, how it was drawn, and the oracle's picture of it."""

    scene: Scene
    size: tuple[int, int]
    slab_thickness: float
    slabs: int
    truth: Numbers
    slicing: Slicing = "stacks"

    @property
    def classification(self) -> str:
        return self.scene.classification


@dataclass(frozen=True)
class Rays:
    """Each pixel's ray: start and way in index space, from where to where (world units), and how it meets the slabs."""

    start: Numbers  # (h, w, 3)
    direction: Numbers  # (h, w, 3), per world unit
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
    volume, camera = drawing.scene.volume, drawing.scene.completed(drawing.size).camera
    origins, directions = camera.rays(drawing.size)
    from_centre = origins - volume.centre
    direction = directions @ volume.index_from_world.T
    start = from_centre @ volume.index_from_world.T + (np.array(volume.dimensions) - 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-0.5 - start) / direction, (np.array(volume.dimensions) - 0.5 - start) / direction
    enters, leaves = np.fmin(a, b).max(axis=2), np.fmax(a, b).min(axis=2)
    cosine = directions @ camera.forward
    first_plane = -(from_centre @ camera.forward) / cosine  # plane 0 goes through the middle of the box
    return Rays(start, direction, np.maximum(enters, 0), leaves, drawing.slab_thickness / cosine, first_plane)


def extinction_of_samples(scene: Scene) -> Numbers:
    """τ at every sample, shape (nx, ny, nz)."""
    assert scene.transfer_function is not None
    return scene.transfer_function.classify(scene.volume.values).extinction.transpose(2, 1, 0)


def kinks(drawing: Drawing, tau: Numbers, rays: Rays, moved: Numbers | None = None) -> Numbers:
    """Error of the depth (h, w) by the changes of slope where rays meet faces of cells; exact, and signed.

    Where faces of axis a have `moved`[a] cells / |v_a|: how much that error changes, at most.

    A change J at a distance a from the nearer plane of its slab: the midpoint rule is off by -J a²/2, the trapezium's
    in each half of the slab by J a (p/2 - a)/2. J is |v| times the second difference of τ; the edge is clamped.
    """
    error = np.zeros(rays.chord.shape)
    for axis, count in enumerate(tau.shape):
        clamped = np.pad(tau, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge")
        second = np.diff(clamped, 2, axis=axis)
        direction = rays.direction[..., axis]
        for layer in np.flatnonzero(np.moveaxis(second, axis, 0).reshape(count, -1).any(axis=1)):
            s = np.divide(
                layer - rays.start[..., axis], direction, out=np.full(direction.shape, np.inf), where=direction != 0
            )
            met = (s > rays.enters) & (s < rays.leaves)
            s = np.where(met, s, 0.0)
            at = np.moveaxis(rays.start + s[..., np.newaxis] * rays.direction, 2, 0)
            at[axis] = layer
            change = map_coordinates(second, at, order=1, mode="nearest") * np.abs(direction)
            a, b = rays.around(s)
            near, p = np.where(met, np.minimum(a, b), 0.0), np.where(met, a + b, 0.0)
            if moved is not None:
                slope = np.abs(p / 2 - 2 * near) if drawing.classification == "integrated" else 2 * near
                error += met * np.abs(change) / np.where(met, np.abs(direction), 1.0) * moved[axis] * slope / 2
                continue
            amount = near * (p / 2 - near) if drawing.classification == "integrated" else -(near**2)
            error += change * amount / 2
    return error


def along(rays: Rays, cells: Numbers) -> Numbers:
    """∫ f ds at most, (h, w), for an f ≥ 0 that is given for each cell: by layers of cells along the best axis."""
    if not cells.size:
        return np.zeros(rays.chord.shape)
    most = rays.chord * cells.max()
    for axis in range(3):
        layers = np.moveaxis(cells, axis, 0)
        total = layers.reshape(len(layers), -1).max(axis=1).sum()
        direction = np.abs(rays.direction[..., axis])
        most = np.minimum(most, np.divide(total, direction, out=np.full(direction.shape, np.inf), where=direction > 0))
    return most


def twist(tau: Numbers, rays: Rays) -> Numbers:
    """∫ |τ''| ds at most along each ray, inside cells: τ'' = 2 Σ v_a v_b τ_ab, shape (h, w)."""
    bent = np.zeros(rays.chord.shape)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        mixed = np.abs(np.diff(np.diff(tau, axis=a), axis=b))
        bent += 2 * np.abs(rays.direction[..., a] * rays.direction[..., b]) * along(rays, mixed)
    return bent


def depth_error(drawing: Drawing, tau: Numbers | None = None) -> Numbers:
    """Error of each ray's optical depth at most, (h, w), where τ is trilinear between samples.

    - Changes of slope inside a slab, see `kinks`: up to J p²/8 each.
    - A second derivative f'': ∫|f''| p²/24 by the midpoint rule, ∫|f''| p²/48 by the trapezium's on half slabs.
    - `slab` interpolates e^-u, u = τ d, instead of u. Trilinear weights are three independent choices, so each axis
      adds at most Δu²/8 to each slab's depth (Hoeffding's lemma; Δu between neighbours), nor more than Δu.
    - `post` and `integrated` read the transfer function `EARLY_POINTS` beside the value.
    """
    tau = extinction_of_samples(drawing.scene) if tau is None else tau
    rays, d = rays_of(drawing), drawing.slab_thickness
    error = np.abs(kinks(drawing, tau, rays))
    error += twist(tau, rays) * rays.path**2 / (48 if drawing.classification == "integrated" else 24)
    if drawing.classification == "slab":
        for axis in range(3):
            steps = np.abs(np.diff(tau * d, axis=axis))
            error += along(rays, np.minimum(steps**2 / 8, steps)) / d
    if drawing.classification in ("post", "integrated"):
        assert drawing.scene.transfer_function is not None
        error += rays.chord * EARLY_POINTS * np.ptp(drawing.scene.transfer_function.extinctions)
    return error


def opacity_error(drawing: Drawing, error: Numbers | float) -> float:
    """Largest error of opacity (and of one colour's light) that an error of the depth (h, w) makes."""
    with np.errstate(divide="ignore"):
        depth = -np.log1p(-drawing.truth[..., 3])
    # Where float64 has opacity 1, all that is known of the depth is that it is over 36, and what the thinnest gives.
    least = np.maximum(36, rays_of(drawing).chord * extinction_of_samples(drawing.scene).min())
    depth = np.where(depth < 36, depth, least)
    return float((np.exp(np.minimum(error - depth, 0)) - np.exp(-depth)).max())


def rounding(drawing: Drawing) -> float:
    """What float32 adds, relative to the brightest of the picture.

    A sum rounds by up to 2^-25 of a result under 1, and what is added to it by a share of that. Sums are as good as
    random, so that n of them come to √(n/3) 2^-25, and the worst of some thousand pixels to five times that. Stacks are
    added to the picture, and runs to their stack, whose light is a share of the picture's. Texel, weights, path and
    series of a slab are relative to its opacity, and so is a sum within a run to the run's: with one sign, four of the
    picture's roundings.
    """
    runs = -(-drawing.slabs // SLABS_PER_RUN)
    sums = blends(drawing) + runs * largest_fraction(drawing) ** 2
    return ULP * float(drawing.truth.max()) * (5 * np.sqrt(sums / 3) / 2 + 4)


def slabs_per_blend(drawing: Drawing) -> int:
    """Slabs of a polygon."""
    if drawing.slicing != "stacks":
        return 1
    return SLABS_PER_STACK // 8 if drawing.classification == "integrated" else SLABS_PER_STACK


def blends(drawing: Drawing) -> int:
    """Blends into one pixel at most."""
    return -(-drawing.slabs // slabs_per_blend(drawing))


def largest_fraction(drawing: Drawing) -> float:
    """Of the picture's light, what one stack gives at most: the densest matter over all its slabs."""
    assert drawing.scene.transfer_function is not None
    if blends(drawing) == 1 or drawing.scene.transfer_function.emissive:
        return 1.0
    depth = extinction_of_samples(drawing.scene).max() * rays_of(drawing).path.max() * slabs_per_blend(drawing)
    return min(1.0, -np.expm1(-depth) / float(drawing.truth.max()))


def trilinear(drawing: Drawing) -> float:
    """One colour, and τ trilinear between samples."""
    return opacity_error(drawing, depth_error(drawing)) + rounding(drawing)


def any_depth(drawing: Drawing) -> float:
    """The same where the depth is so large that its own rounding shows at silhouettes, where little is crossed."""
    rays, tau = rays_of(drawing), extinction_of_samples(drawing.scene).max()
    digits = ULP * tau * (4 * rays.chord + rays.per_slab) * (rays.chord > 0)
    return opacity_error(drawing, depth_error(drawing) + digits) + rounding(drawing)


def jumping(drawing: Drawing, around: Volume, jump: float) -> float:
    """Matter that jumps by up to `jump` at the faces of the cells of one sample of a ramp: twice inside a slab."""
    whole = replace(drawing, scene=replace(drawing.scene, volume=around))
    depth = depth_error(whole) + 2 * jump * rays_of(drawing).path / 2
    return opacity_error(drawing, depth) + rounding(drawing)


def misplaced(drawing: Drawing, jump: float, within: float) -> float:
    """A jump of τ at a place that is known to `within` slabs."""
    return opacity_error(drawing, jump * within * rays_of(drawing).path) + rounding(drawing)


def hidden(drawing: Drawing, haze: float, within: float) -> float:
    """Haze of extinction `haze` in front of an opaque wall of another colour, which is placed to `within` slabs."""
    return float(np.expm1(haze * within * rays_of(drawing).path.max())) + rounding(drawing)


def spiked(drawing: Drawing, width: float) -> float:
    """A narrow triangle in the transfer function of 8-bit values, its sides `width` levels wide, at about level 100.

    Its two outer points are stored as shares of 255 between 1/4 and 1/2, to 2^-26; its area follows their distance.
    """
    opacity = drawing.truth[..., 3]
    if drawing.classification == "post":
        return float(np.maximum(opacity, 1 - opacity).max())
    depth = -np.log1p(-opacity)
    return opacity_error(drawing, depth * 255 * 2.0**-26 / width) + rounding(drawing)


def with_texels(drawing: Drawing, texel_format: str) -> float:
    """Texels rounded: emission by δq and extinction by δτ; light changes by L φ δq and by as much as opacity."""
    if texel_format == "rgba32f":
        return trilinear(drawing)
    rays, tau = rays_of(drawing), extinction_of_samples(drawing.scene)
    depth = -np.log1p(-drawing.truth[..., 3])
    seen = drawing.truth[..., 3] / np.where(depth > 0, depth, 1)  # φ
    rounded = rays.chord * 4 * 0.5 / 255 * tau.max() if texel_format == "rgba8" else depth * 2.0**-11
    opacity = opacity_error(drawing, depth_error(drawing) + rounded)
    return opacity + float((rounded * seen).max()) + rounding(drawing)


def with_target(drawing: Drawing, target_format: str) -> float:
    """A target that rounds what comes and what it adds to, at each blend."""
    power_of_two = float(np.exp2(np.ceil(np.log2(drawing.truth.max()))))
    rounded = {"rgba8": 1 / 255, "rgba16f": 2.0**-11 * power_of_two, "rgba32f": 0.0}[target_format]
    return trilinear(drawing) + rounded * blends(drawing)


def glowing(drawing: Drawing) -> float:
    """Emission without extinction, constant: the light is that of the texel, half-float."""
    return float(drawing.truth.max()) * (2.0**-11 + 4 * ULP) + rounding(drawing)


def turning(drawing: Drawing, angle: float) -> float:
    """How much the error changes where the view turns by `angle` about the middle of the box.

    A face at a slant v from the ray moves along it by R θ / |v h|, with it the place of the change of slope, and the
    depth's error with the first derivative of `kinks`, J a or J |p/2 - 2a|/2. Trilinear weights move by R θ / h, and
    with them opacity's part of `slab`: Δu²/2 a slab and weight.
    """
    volume, rays, tau = drawing.scene.volume, rays_of(drawing), extinction_of_samples(drawing.scene)
    swing = volume.radius * angle
    depth = kinks(drawing, tau, rays, moved=swing / volume.spacing)
    if drawing.classification == "slab":
        for axis in range(3):
            squares = along(rays, np.diff(tau * drawing.slab_thickness, axis=axis) ** 2)
            depth += squares / drawing.slab_thickness / 2 * swing / volume.spacing[axis]
    return opacity_error(drawing, depth) + 4 * angle * trilinear(drawing) + 2 * rounding(drawing)
