"""Reference implementation of slabs in plain numpy: the error to expect from a scene, independent of the renderer.

A renderer's own estimate of its error contains its mistakes: with opacity linear in depth the error is larger and of
first order, and so is the estimate. So this module composites the same slabs from formulas alone, ray by ray:

    slab k of a ray lies between planes k and k + 1, whose distance is measured across the view, the first plane through
    the middle of the box; box and eye clip the slab to [a, b]; l = b - a; its medium is that at the middle (a + b) / 2
    A = 1 - e^-τl,  C = q l (1 - e^-τl) / τl,  picture = Σ C_k Π_{j<k} (1 - A_j)

The distance from the oracle's picture is the error of slabs of that thickness. The picture is also computed with
weights of 8 bits between the samples, as graphics cards interpolate; the change counts as error, too.

Slabs may be divided: with the optical depth x of a slab, by the medium in its middle, the share 64 x - 1 of its colour,
from 0 to 1, is that of its thirds, each with the medium in its own middle, and the rest is that of the whole slab.

With several volumes a slab is also divided where the ray enters or leaves a volume, and the q l and τ l of the volumes
in a piece are added. Label volumes are not drawn: each sample is a box of its own, for which slabs have no middle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.threads import in_threads

Numbers = NDArray[np.float64]
_RAYS_AT_ONCE = 1 << 14
_WEIGHT_STEPS = 256  # weights of a graphics card between two samples
_PARTS = 4  # of half a slab, for the integral of `integrated`
_DEEPEST_SLAB = 2.0  # optical depth of a slab of texels of `slab`
_LEAST_DIVIDED = 1 / 16  # optical depth of a path as long as the spacing, from which on slabs are divided


@dataclass(frozen=True)
class _Rays:
    """Rays in a volume's index space: start and direction per world unit (n, 3), entry, exit and planes (n,)."""

    start: Numbers
    direction: Numbers
    enters: Numbers
    leaves: Numbers
    first_plane: Numbers
    per_slab: Numbers

    def part(self, part: slice | NDArray[np.intp]) -> _Rays:
        return _Rays(*(getattr(self, name)[part] for name in self.__dataclass_fields__))


def can_draw(scene: Scene) -> bool:
    """True if this module computes the opacity of the scene."""
    if scene.mode != "composite" or scene.clip or scene.crop or scene.geometry:
        return False
    return all(map(_is_plain, scene.completed((1, 1)).each_alone()))


def _is_plain(scene: CompleteScene) -> bool:
    """True if a volume's medium is finite, smooth between samples, and depends on the value alone."""
    volume, medium = scene.volume, scene.medium
    if volume.nearest or medium.needs_gradient:
        return False
    return bool(np.isfinite(medium.extinctions).all() and np.isfinite(volume.values).all())


def knows_color(scene: Scene) -> bool:
    """True if this module computes the scene's colour, too: light is not modelled."""
    return scene.lighting is None and scene.depth_cue is None


def pictures_of_slabs(
    scene: Scene, size: tuple[int, int], slab_thickness: float, texel_format: str = "exact", divides: bool = False
) -> tuple[Numbers, Numbers]:
    """Return the scene's picture (height, width, 4) over its background, and the same with weights of 8 bits.

    `divides` is True for slabs of `post` that are divided where they are not nearly transparent.
    """
    drawn = _pictures(scene, size, slab_thickness, texel_format, divides, (0, _WEIGHT_STEPS))
    return drawn[0], drawn[1]


def picture_of_slabs(scene: Scene, size: tuple[int, int], slab_thickness: float, divides: bool = False) -> Numbers:
    """Return the first picture of `pictures_of_slabs` alone, in half the time."""
    return _pictures(scene, size, slab_thickness, "exact", divides, (0,))[0]


def _pictures(
    scene: Scene,
    size: tuple[int, int],
    slab_thickness: float,
    texel_format: str,
    divides: bool,
    weight_steps: Iterable[int],
) -> list[Numbers]:
    """Return the scene's picture by each number of weights between two samples; 0 is for exact weights."""
    complete = scene.completed(size)
    camera = complete.camera
    volumes = [
        (
            _rays_of(each.volume, camera, scene.volume.centre, size, slab_thickness),
            _field_of(each, slab_thickness, texel_format),
        )
        for each in complete.each_alone()
    ]
    count = size[0] * size[1]
    parts = [slice(start, start + _RAYS_AT_ONCE) for start in range(0, count, _RAYS_AT_ONCE)]
    least_divided = _LEAST_DIVIDED * slab_thickness / scene.smallest_spacing if divides else np.inf
    drawn = []
    for steps in weight_steps:
        composited = partial(_composited, volumes, steps=steps, least_divided=least_divided)
        pieces = in_threads(composited, parts)
        picture = np.concatenate(pieces).reshape(size[1], size[0], 4)
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(scene.background)
        drawn.append(picture)
    return drawn


def _rays_of(volume: Volume, camera: Camera, middle: Numbers, size: tuple[int, int], slab_thickness: float) -> _Rays:
    """Return the rays of a picture in one of its volumes; slabs are counted from `middle`."""
    origins, directions = (each.reshape(-1, 3) for each in camera.rays(size))
    from_centre = origins - volume.centre
    direction = directions @ volume.index_from_world.T
    samples = np.array(volume.dimensions)
    start = from_centre @ volume.index_from_world.T + (samples - 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-0.5 - start) / direction, (samples - 0.5 - start) / direction
    cosine = directions @ np.asarray(camera.forward)
    return _Rays(
        start,
        direction,
        np.maximum(np.fmin(a, b).max(axis=1), 0),
        np.fmax(a, b).min(axis=1),
        -((origins - middle) @ np.asarray(camera.forward)) / cosine,
        slab_thickness / cosine,
    )


@dataclass(frozen=True)
class _Field:
    """Medium of one volume as a function of position: emission and extinction, or texels of slabs."""

    grid: NDArray  # (nz, ny, nx, channels)
    medium: TransferFunction | None = None  # classifies interpolated values; None: the grid holds the medium
    length_unit: float = 0.0  # of texels of colour and opacity; 0: texels of emission and extinction
    halves: bool = False  # True to integrate each half of a slab

    def parts(self, count: int, rays: _Rays, front: Numbers, back: Numbers, steps: int) -> Numbers:
        """Emission and extinction times length (count, n, 4) of `count` equal parts of slabs from `front` to `back`."""
        length = (back - front)[:, np.newaxis] / count
        if not self.halves:
            whole = self._medium_of(self._at(rays, (front + back) / 2, steps))
            return np.broadcast_to(whole * length, (count, *whole.shape))
        ends = [self._at(rays, front + fraction * (back - front), steps) for fraction in (0.0, 0.5, 1.0)]
        return np.stack([
            self._medium_of(one + (part + 0.5) / (count // 2) * (other - one)) * length
            for one, other in pairwise(ends)
            for part in range(count // 2)
        ])  # fmt: skip

    def thirds(self, rays: _Rays, front: Numbers, back: Numbers, steps: int) -> Numbers:
        """Emission and extinction times length (3, n, 4) of thirds of slabs, each by the medium in its middle."""
        third = (back - front) / 3
        texels = [self._at(rays, front + (part + 0.5) * third, steps) for part in range(3)]
        return np.stack([self._medium_of(each) * third[:, np.newaxis] for each in texels])

    def _medium_of(self, texels: Numbers) -> Numbers:
        """Emission and extinction (n, 4)."""
        if self.medium is not None:
            emission, extinction = self.medium.classify(texels[:, 0])
            return np.column_stack([emission, extinction]) * texels[:, 1:]
        if not self.length_unit:
            return texels
        depth = -np.log1p(-np.minimum(texels[:, 3], 1 - 2.0**-53))
        emission = texels[:, :3] / _mean_transmittance(depth)[:, np.newaxis]
        return np.column_stack([emission, depth]) / self.length_unit

    def _at(self, rays: _Rays, distance: Numbers, steps: int) -> Numbers:
        """Return the stored numbers, interpolated trilinearly (n, channels); constant beyond the outermost samples."""
        position = rays.start + distance[:, np.newaxis] * rays.direction
        if steps:
            position = np.rint(position * steps) / steps
        counts = np.array(self.grid.shape[2::-1])
        position = np.clip(position, 0, counts - 1)
        low = np.minimum(position.astype(np.intp), np.maximum(counts - 2, 0))
        fraction = position - low
        high = np.minimum(low + 1, counts - 1)
        found = np.zeros((len(position), self.grid.shape[3]))
        for corner in range(8):
            x, y, z = (high[:, axis] if corner >> axis & 1 else low[:, axis] for axis in range(3))
            weights = [fraction[:, axis] if corner >> axis & 1 else 1 - fraction[:, axis] for axis in range(3)]
            found += (weights[0] * weights[1] * weights[2])[:, np.newaxis] * self.grid[z, y, x]
        return found


def _field_of(scene: CompleteScene, slab_thickness: float, texel_format: str) -> _Field:
    volume, medium = scene.volume, scene.medium
    mask = np.ones(volume.shape) if scene.mask is None else scene.mask.array.astype(np.float64)
    if scene.classification in ("post", "integrated") and volume.colors is None:
        grid = np.stack([volume.values.astype(np.float64), mask], axis=3)
        return _Field(grid, medium, halves=scene.classification == "integrated")
    emission, extinction = medium.classify(volume.values)
    if volume.colors is not None:
        emission = emission * volume.colors
    length_unit = 0.0
    texels = np.concatenate([emission, extinction[..., np.newaxis]], axis=3) * mask[..., np.newaxis]
    if scene.classification == "slab":
        length_unit = min(slab_thickness, _DEEPEST_SLAB / max(float(extinction.max()), 1e-300))
        texels = _slab_color(texels.reshape(-1, 4) * length_unit).reshape(texels.shape)
    return _Field(_rounded(texels, texel_format), length_unit=length_unit)


def _slab_color(amounts: Numbers) -> Numbers:
    """Premultiplied colour and opacity of slabs with that emission and extinction times length (n, 4)."""
    depth = amounts[:, 3]
    return np.column_stack([amounts[:, :3] * _mean_transmittance(depth)[:, np.newaxis], -np.expm1(-depth)])


def _mean_transmittance(depth: Numbers) -> Numbers:
    return np.divide(-np.expm1(-depth), depth, out=np.ones_like(depth), where=depth > 0)


def _rounded(texels: Numbers, texel_format: str) -> Numbers:
    """Return texels rounded to their format, relative to the largest."""
    scale = np.array([texels[..., :3].max() or 1.0] * 3 + [texels[..., 3].max() or 1.0])
    if texel_format == "rgba8":
        return np.rint(texels / scale * 255) / 255 * scale
    return (texels / scale).astype(np.float16) * scale if texel_format == "rgba16f" else texels


def _composited(volumes: Sequence[tuple[_Rays, _Field]], part: slice, steps: int, least_divided: float) -> Numbers:
    """Return premultiplied colour and opacity (n, 4) of some of the rays, slab by slab, front to back.

    Slabs of at least an optical depth are divided.
    """
    all_rays = [rays.part(part) for rays, _ in volumes]
    color = np.zeros((len(all_rays[0].enters), 4))
    count = 2 * _PARTS if any(field.halves for _, field in volumes) else 1
    for slab in _slabs_of(all_rays):
        for front, back in _pieces(all_rays, slab):
            amounts = np.zeros((count, *color.shape))
            for rays, (_, field) in zip(all_rays, volumes, strict=True):
                inside = np.flatnonzero((front < back) & (rays.enters <= front) & (back <= rays.leaves))
                if inside.size:
                    amounts[:, inside] += field.parts(count, rays.part(inside), front[inside], back[inside], steps)
            slab_color = _over(map(_slab_color, amounts)) if amounts.any() else np.zeros(color.shape)
            if least_divided < np.inf and inside.size:
                share = np.clip(amounts[0, inside, 3:] / least_divided - 1, 0, 1)
                thirds = field.thirds(rays.part(inside), front[inside], back[inside], steps)
                slab_color[inside] += share * (_over(map(_slab_color, thirds)) - slab_color[inside])
            color += (1 - color[:, 3:]) * slab_color
    return color


def _over(colors: Iterable[Numbers]) -> Numbers:
    """Return premultiplied colours and opacities (n, 4), composited front to back."""
    return reduce(lambda front, back: front + (1 - front[:, 3:]) * back, colors)


def _pieces(all_rays: Sequence[_Rays], slab: int) -> Iterator[tuple[Numbers, Numbers]]:
    """Yield start and end of each piece of a slab, divided where rays enter and leave volumes."""
    first = all_rays[0]
    start = first.first_plane + slab * first.per_slab
    end = first.first_plane + (slab + 1) * first.per_slab
    between = [
        np.where(rays.enters < rays.leaves, np.clip(position, start, end), start)
        for rays in all_rays
        for position in (rays.enters, rays.leaves)
    ]
    return pairwise(np.sort([start, *between, end], axis=0))


def _slabs_of(all_rays: Sequence[_Rays]) -> range:
    """Return the slabs that a ray crosses in a volume."""
    first, last = [], []
    for rays in all_rays:
        hit = rays.enters < rays.leaves
        first += np.floor((rays.enters - rays.first_plane) / rays.per_slab)[hit].tolist()
        last += np.ceil((rays.leaves - rays.first_plane) / rays.per_slab)[hit].tolist()
    return range(int(min(first)), int(max(last))) if first else range(0)
