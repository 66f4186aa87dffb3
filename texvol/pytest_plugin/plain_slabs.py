"""What a scene drawn in slabs is to look like, by plain numpy: the expected error, without the renderer's word for it.

A renderer's own estimate is that of its mistakes as well: with opacity taken as linear in depth the error is larger
and of first order, and so is the estimate. So the same slabs are composited here from formulas alone, ray by ray:

    slab k of a ray lies between planes k and k + 1, at distance d across the view, the first through the middle of the
    box; the box and the eye cut it to [a, b]; l = b - a, and its matter is that at the middle (a + b) / 2
    A = 1 - e^-τl,  C = q l (1 - e^-τl) / τl,  picture = Σ C_k Π_{j<k} (1 - A_j)

Its distance from the oracle's picture is the error that slabs of that thickness have. It is also drawn with weights of
8 bits between the samples, which is how graphics cards interpolate: what that changes counts as error, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texvol.scene import Scene
from texvol.threads import in_threads
from texvol.transfer import TransferFunction, proposed_for

Numbers = NDArray[np.float64]
_RAYS_AT_ONCE = 1 << 14
_WEIGHT_STEPS = 256  # of a graphics card's weights between two samples
_PARTS = 4  # of half a slab, by which `integrated` is integrated here
_DEEPEST_SLAB = 2.0  # optical depth of the slab that texels of `slab` stand for


@dataclass(frozen=True)
class _Rays:
    """Rays in index space: start and way per world unit (n, 3), from where to where and from plane to plane (n,)."""

    start: Numbers
    way: Numbers
    enters: Numbers
    leaves: Numbers
    first_plane: Numbers
    per_slab: Numbers

    def part(self, part: slice) -> _Rays:
        return _Rays(*(getattr(self, name)[part] for name in self.__dataclass_fields__))


def can_draw(scene: Scene) -> bool:
    """Whether the opacity of a scene is known here."""
    matter = scene.transfer_function or proposed_for(scene.volume)
    finite = bool(np.isfinite(matter.extinctions).all() and np.isfinite(scene.volume.values).all())
    return scene.mode == "composite" and not matter.needs_gradient and finite


def knows_color(scene: Scene) -> bool:
    """Whether its colour is, too: light is not modelled."""
    return scene.lighting is None and scene.depth_cue is None


def pictures_of_slabs(
    scene: Scene, size: tuple[int, int], slab_thickness: float, texel_format: str = "exact"
) -> tuple[Numbers, Numbers]:
    """The scene's picture (height, width, 4), background included; and the same with weights of 8 bits."""
    scene_rays = _rays_of(scene, size, slab_thickness)
    field = _field_of(scene, slab_thickness, texel_format)
    count = size[0] * size[1]
    parts = [slice(start, start + _RAYS_AT_ONCE) for start in range(0, count, _RAYS_AT_ONCE)]
    drawn = []
    for steps in (0, _WEIGHT_STEPS):
        pieces = in_threads(lambda part, steps=steps: _composited(scene_rays.part(part), field, steps), parts)  # type: ignore[misc]
        picture = np.concatenate(pieces).reshape(size[1], size[0], 4)
        picture[..., :3] += (1 - picture[..., 3:]) * np.asarray(scene.background)
        drawn.append(picture)
    return drawn[0], drawn[1]


def _rays_of(scene: Scene, size: tuple[int, int], slab_thickness: float) -> _Rays:
    volume, camera = scene.volume, scene.camera_for(size)
    origins, directions = (each.reshape(-1, 3) for each in camera.rays(size))
    from_centre = origins - volume.centre
    way = directions @ volume.index_from_world.T
    samples = np.array(volume.dimensions)
    start = from_centre @ volume.index_from_world.T + (samples - 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-0.5 - start) / way, (samples - 0.5 - start) / way
    cosine = directions @ np.asarray(camera.forward)
    return _Rays(
        start,
        way,
        np.maximum(np.fmin(a, b).max(axis=1), 0),
        np.fmax(a, b).min(axis=1),
        -(from_centre @ np.asarray(camera.forward)) / cosine,
        slab_thickness / cosine,
    )


class _Field:
    """Matter at a place: emission and extinction, or what texels of a slab give for a length."""

    def __init__(
        self, grid: NDArray, matter: TransferFunction | None, length_unit: float = 0.0, halves: bool = False
    ) -> None:
        self._grid = grid  # (nz, ny, nx, channels)
        self._matter = matter  # classifies what is interpolated; None: it is matter already
        self._length_unit = length_unit  # of texels that hold colour and opacity; 0: they hold emission and extinction
        self.halves = halves

    def color(self, rays: _Rays, front: Numbers, back: Numbers, steps: int) -> Numbers:
        """Premultiplied colour and opacity (n, 4) of slabs from `front` to `back` along the rays."""
        length = back - front
        if not self.halves:
            return self._of_texels(self._at(rays, (front + back) / 2, steps), length)
        ends = [self._at(rays, front + share * length, steps) for share in (0.0, 0.5, 1.0)]
        color = np.zeros((len(length), 4))
        for one, other in ((ends[0], ends[1]), (ends[1], ends[2])):
            for part in range(_PARTS):
                between = one + (part + 0.5) / _PARTS * (other - one)
                color += (1 - color[:, 3:]) * self._of_texels(between, length / (2 * _PARTS))
        return color

    def _of_texels(self, texels: Numbers, length: Numbers) -> Numbers:
        if self._length_unit:
            depth = -np.log1p(-np.minimum(texels[:, 3], 1 - 2.0**-53)) * length / self._length_unit
            opacity = -np.expm1(-depth)
            thin = length / self._length_unit
            share = np.divide(opacity, texels[:, 3], out=thin, where=texels[:, 3] > 0)
            return np.column_stack([texels[:, :3] * share[:, np.newaxis], opacity])
        if self._matter is not None:
            emission, extinction = self._matter.classify(texels[:, 0])
        else:
            emission, extinction = texels[:, :3], texels[:, 3]
        return _slab_color(emission, extinction, length)

    def _at(self, rays: _Rays, distance: Numbers, steps: int) -> Numbers:
        """What is stored, interpolated trilinearly (n, channels); beyond the outermost samples they hold on."""
        place = rays.start + distance[:, np.newaxis] * rays.way
        if steps:
            place = np.rint(place * steps) / steps
        counts = np.array(self._grid.shape[2::-1])
        place = np.clip(place, 0, counts - 1)
        low = np.minimum(place.astype(np.intp), np.maximum(counts - 2, 0))
        share = place - low
        high = np.minimum(low + 1, counts - 1)
        found = np.zeros((len(place), self._grid.shape[3]))
        for corner in range(8):
            x, y, z = (high[:, axis] if corner >> axis & 1 else low[:, axis] for axis in range(3))
            weights = [share[:, axis] if corner >> axis & 1 else 1 - share[:, axis] for axis in range(3)]
            found += (weights[0] * weights[1] * weights[2])[:, np.newaxis] * self._grid[z, y, x]
        return found


def _field_of(scene: Scene, slab_thickness: float, texel_format: str) -> _Field:
    matter, values = scene.transfer_function or proposed_for(scene.volume), scene.volume.values
    if scene.classification in ("post", "integrated"):
        grid = values[..., np.newaxis].astype(np.float64)
        return _Field(grid, matter, halves=scene.classification == "integrated")
    emission, extinction = matter.classify(values)
    length_unit = 0.0
    texels = np.concatenate([emission, extinction[..., np.newaxis]], axis=3)
    if scene.classification == "slab":
        length_unit = min(slab_thickness, _DEEPEST_SLAB / max(float(extinction.max()), 1e-300))
        flat = texels.reshape(-1, 4)
        texels = _slab_color(flat[:, :3], flat[:, 3], np.full(len(flat), length_unit)).reshape(texels.shape)
    return _Field(_rounded(texels, texel_format), None, length_unit)


def _slab_color(emission: Numbers, extinction: Numbers, length: Numbers) -> Numbers:
    depth = extinction * length
    opacity = -np.expm1(-depth)
    mean_transmittance = np.divide(opacity, depth, out=np.ones_like(depth), where=depth > 0)
    return np.column_stack([emission * (length * mean_transmittance)[:, np.newaxis], opacity])


def _rounded(texels: Numbers, texel_format: str) -> Numbers:
    """Texels as their format holds them: relative to the largest."""
    scale = np.array([texels[..., :3].max() or 1.0] * 3 + [texels[..., 3].max() or 1.0])
    if texel_format == "rgba8":
        return np.rint(texels / scale * 255) / 255 * scale
    return (texels / scale).astype(np.float16) * scale if texel_format == "rgba16f" else texels


def _composited(rays: _Rays, field: _Field, steps: int) -> Numbers:
    """Premultiplied colour and opacity (n, 4) of rays, slab by slab, front to back."""
    color = np.zeros((len(rays.enters), 4))
    hit = rays.enters < rays.leaves
    if not hit.any():
        return color
    first = np.floor((rays.enters - rays.first_plane) / rays.per_slab)[hit].min()
    last = np.ceil((rays.leaves - rays.first_plane) / rays.per_slab)[hit].max()
    whole = partial(np.maximum, rays.enters), partial(np.minimum, rays.leaves)
    for slab in range(int(first), int(last)):
        front = whole[0](rays.first_plane + slab * rays.per_slab)
        back = whole[1](rays.first_plane + (slab + 1) * rays.per_slab)
        inside = np.flatnonzero(hit & (front < back))
        if inside.size:
            behind = field.color(_taken(rays, inside), front[inside], back[inside], steps)
            color[inside] += (1 - color[inside, 3:]) * behind
    return color


def _taken(rays: _Rays, chosen: NDArray[np.intp]) -> _Rays:
    return _Rays(*(getattr(rays, name)[chosen] for name in rays.__dataclass_fields__))
