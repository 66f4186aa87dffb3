"""The precomputation: volume, transfer function and slab thickness in, premultiplied texels of a 3D texture out.

What a texel holds depends on the classification:

    slab         colour and opacity of one whole slab, C = q L φ(τL) and A = 1 - e^-τL     (Wilson et al. 1994)
    extinction   emission and extinction, q and τ, exponentiated after the fetch

Both are premultiplied, so that interpolation mixes media and not names of colours (Wittenbrink et al. 1998). Texels
are stored relative to a scale, the largest of the volume: a medium of extinction 1e-12 keeps its digits in half
precision, and 8 bits are spent on what is there. Lengths are counted in slabs (`slab`) or in the volume's smallest
spacing (`extinction`), so that a world of 1e-9 or 1e9 gives the same texels.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene import optics
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Classification
from texvol.scene.transfer import Classified, TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.slabs import SLABS_PER_STACK
from texvol.util.statistics import distinct
from texvol.util.threads import in_threads

TEXEL_TYPES: dict[str, np.dtype] = {
    "rgba8": np.dtype(np.uint8),
    "rgba16f": np.dtype(np.float16),
    "rgba32f": np.dtype(np.float32),
}
TEXEL_FORMATS = tuple(TEXEL_TYPES)
Box = tuple[slice, slice, slice]  # of samples, along z, y, x
# What stands for an infinite extinction and all above it, per smallest spacing. In float32, interpolated with a weight
# of 1e-6 it is still opaque over a millionth of a voxel, and its square is finite. The others have no room for that
# beside the finite extinctions, which share their range: opaque over a thousandth of a voxel, and over a third.
_OPAQUE_EXTINCTION = {"rgba8": 32.0, "rgba16f": 1e4, "rgba32f": 1e16}
_DEEPEST_SLAB = 2.0  # optical depth: leaves 1 - A all but 3 of float32's bits
_OPAQUEST = 0.8873  # for `depth_per_opacity` of the shader
_LONGEST_SLAB = 1e30  # in units of length of the texels: opaque if anything is there, and times 0 still 0
_LOOKED_UP = 1 << 17  # samples looked up at once, which is little work for each
_CHUNK = 1 << 15  # samples classified at once: few enough for the cache, many enough for threads
_LARGEST_PART = 1 << 18  # samples lit at once, so that each thread takes some 20 MB
_SMALLEST_PART = 1 << 16  # samples lit by one thread: beginning another one takes longer

Classifier = Callable[[NDArray], NDArray[np.float64]]  # values (n,) → texels (n, 4), unscaled
OfMedium = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]  # see `_medium_encoder`
Samples = Callable[[Box], tuple[NDArray[np.intp], Classified]]  # a box → which samples show anything, and their medium


@dataclass(frozen=True)
class SlabTexture:
    """Texels of shape (nz, ny, nx, 4): how to make them, their scale and their meaning.

    `length_unit` (world units) is what the texels count lengths in: the slab that those of `slab` stand for, what
    emission and extinction are per in those of `extinction`.
    """

    volume: Volume
    scale: NDArray[np.float64]
    largest: float  # opacity, or optical depth
    classification: Classification
    length_unit: float
    texel_format: str
    classifier: Classifier
    of_medium: OfMedium
    samples: Samples | None = None  # where values alone don't tell
    hidden: NDArray[np.bool_] | None = None  # (nz, ny, nx)

    def texels(self, box: Box = (slice(None),) * 3) -> NDArray:
        """Texels of a box of samples, shape (nz, ny, nx, 4), of `TEXEL_TYPES[texel_format]`."""
        if self.samples is None:
            texels = _classified(self.volume.values[box], self._encode, self._table, TEXEL_TYPES[self.texel_format])
            if self.hidden is not None:
                texels[self.hidden[box]] = 0
            return texels
        z, y, x = (range(*part.indices(count)) for part, count in zip(box, self.volume.shape, strict=True))
        texels = np.zeros((len(z), len(y), len(x), 4), TEXEL_TYPES[self.texel_format])
        in_threads(partial(self._fill, self.samples, texels, (z, y, x)), _parts(*texels.shape[:3]))
        return texels

    def _fill(
        self, samples: Samples, texels: NDArray, box: tuple[range, range, range], part: tuple[slice, slice]
    ) -> None:
        """Write what shows of some layers and rows of a box."""
        z, y, x = box[0][part[0]], box[1][part[1]], box[2]
        shows, medium = samples((slice(z.start, z.stop), slice(y.start, y.stop), slice(x.start, x.stop)))
        numbers = self.of_medium(*medium)
        rows, columns = np.divmod(shows, len(x))
        layers, rows = np.divmod(rows, len(y))
        texels[part][layers, rows, columns] = self._rounded(numbers)

    def all_texels(self, box: Box) -> dict[str, NDArray]:
        """Texels of a box of samples, by the name of the sampler."""
        return {"texels": self.texels(box)}

    @property
    def formats(self) -> dict[str, tuple[str, int]]:
        """Texel format and numbers in a texel of each texture, by the name of its sampler."""
        return {"texels": (self.texel_format, 4)}

    @property
    def slabs_per_stack(self) -> int:
        """Largest number of slabs that a fragment goes through."""
        return SLABS_PER_STACK

    def switches(self, slab_thickness: float, obliquity: float) -> dict[str, int]:
        """Switches of the shader; between two planes at distance 1 the longest ray's length is `obliquity`."""
        if self.classification == "extinction":
            deepest = self.largest * self.uniforms(slab_thickness)["slab_length"] * obliquity
            return {"CLASSIFICATION": 1, "SHALLOW": int(optics.is_shallow(deepest))}
        whole = 0
        if slab_thickness == self.length_unit:
            opacity = min(self.largest, 1.0)
            more = (obliquity - 1) * float(optics.depth_from_opacity(opacity))
            whole = 1 if obliquity == 1 else 2 if opacity < _OPAQUEST and more <= 0.5 else 0
        return {"CLASSIFICATION": 0, "WHOLE_SLABS": whole}

    def uniforms(self, slab_thickness: float) -> dict[str, Any]:
        """Uniforms of the shader."""
        slab_length = min(slab_thickness / self.length_unit, _LONGEST_SLAB)
        return {"texel_scale": tuple(self.scale), "slab_length": slab_length}

    @property
    def tables(self) -> dict[str, NDArray[np.float32]]:
        """Further textures that the shader wants: none, all is in the texels."""
        return {}

    def _encode(self, values: NDArray) -> NDArray:
        """Texels (n, 4) for values (n,)."""
        return self._rounded(self.classifier(values))

    def _rounded(self, numbers: NDArray[np.float64]) -> NDArray:
        dtype = TEXEL_TYPES[self.texel_format]
        texels = numbers / self.scale
        if dtype == np.uint8:
            return np.rint(np.clip(texels, 0, 1) * 255).astype(dtype)
        return texels.astype(dtype)

    @cached_property
    def _table(self) -> tuple[NDArray, int] | None:
        """Texels of every integer from the smallest to the largest value, and the smallest; None if those are many."""
        values = self.volume.values
        if values.dtype.kind not in "iu" or values.dtype.itemsize > 2 or values.size <= 1 << 12:
            return None
        low, high = (int(end) for end in self.volume.value_range or (0, 0))
        return self._encode(np.arange(low, high + 1)), low


def bake(
    volume: Volume,
    transfer_function: TransferFunction,
    classification: Classification,
    slab_thickness: float,
    texel_format: str = "rgba32f",
    samples: Samples | None = None,
    lighting: Lighting | None = None,
    hidden: NDArray[np.bool_] | None = None,
    whole_slabs: bool = False,
) -> SlabTexture:
    """The 3D texture of a volume; `slab_thickness` is in world units. Its texels are made when they are asked for.

    The slab that texels of `slab` stand for is a thinner one in a dense medium, of optical depth 2 at most: of
    opacities nearer to 1 float32 would have no digits left to tell how much of a slab that the box cuts short is to
    be seen; with `whole_slabs` it is all of the slab. Where values alone don't tell what is at a sample, `samples`
    does, in that light; what is `hidden` is not there.
    """
    length_unit = volume.smallest_spacing
    if classification == "slab" and whole_slabs:
        length_unit = slab_thickness
    elif classification == "slab":
        largest_extinction = _largest_extinction(volume, transfer_function)
        length_unit = min(slab_thickness, _DEEPEST_SLAB / largest_extinction if largest_extinction > 0 else np.inf)
    opaque = _OPAQUE_EXTINCTION[texel_format]
    classifier = texel_classifier(transfer_function, classification, length_unit, opaque)
    of_medium = _medium_encoder(transfer_function, classification, length_unit, opaque)
    largest = classifier(_positions(volume, transfer_function)).max(axis=0)
    if samples is not None:
        emission, extinction = _most_medium(volume, transfer_function)
        texels = of_medium(emission, extinction)
        if classification == "slab":
            # Not all of it has to be there, and what glows is brighter without what absorbs.
            texels[:, :3] = emission * np.where(np.isinf(extinction), 1.0, length_unit)[:, np.newaxis]
        largest = texels.max(axis=0)
        if lighting is not None:
            diffuse, highlight = lighting.most
            largest[:3] = diffuse * largest[:3] + highlight * largest[3]
    scale = _texel_scale(largest, TEXEL_TYPES[texel_format])
    recipe = classification, length_unit, texel_format, classifier, of_medium, samples, hidden
    return SlabTexture(volume, scale, float(largest[3]), *recipe)


def texel_classifier(
    transfer_function: TransferFunction, classification: Classification, length_unit: float, opaque_extinction: float
) -> Classifier:
    """Function that takes values (n,) to texels (n, 4): emission or colour, and extinction or opacity.

    Of matter that depends on the gradient it knows nothing.
    """
    points = _points_alone(transfer_function)
    of_medium = _medium_encoder(transfer_function, classification, length_unit, opaque_extinction)

    def classify(values: NDArray) -> NDArray[np.float64]:
        if classification == "extinction" or transfer_function.glows:
            return of_medium(*points.classify(values))
        # q = cτ makes C = c A, and the colour is at hand: a third less work.
        texels = transfer_function.at(values)
        opacity = optics.opacity_from_depth(texels[:, 3] * length_unit)
        texels[:, :3] *= opacity[:, np.newaxis]
        texels[:, 3] = opacity
        return texels

    return classify


def _medium_encoder(
    transfer_function: TransferFunction, classification: Classification, length_unit: float, opaque_extinction: float
) -> OfMedium:
    """Return the function that takes a medium, as `TransferFunction.classify` has it, to texels (n, 4), unscaled."""

    def encode(emission: NDArray[np.float64], extinction: NDArray[np.float64]) -> NDArray[np.float64]:
        if classification == "slab":
            color, opacity = optics.slab_integral(emission, extinction, length_unit)
            return np.concatenate([color, opacity[:, np.newaxis]], axis=1)
        depth = (extinction * length_unit)[:, np.newaxis]
        glow = emission * length_unit
        opaque = depth[:, 0] > opaque_extinction
        if opaque.any():
            depth[opaque] = opaque_extinction
            if not transfer_function.emissive:
                # q = cτ with what stands for τ; where τ is infinite `emission` is the colour c that shows.
                finite = np.where(np.isinf(extinction), 1.0, extinction)[opaque, np.newaxis]
                glow[opaque] = emission[opaque] / finite * opaque_extinction
        return np.concatenate([glow, depth], axis=1)

    return encode


def _points_alone(transfer_function: TransferFunction) -> TransferFunction:
    if not transfer_function.needs_gradient:
        return transfer_function
    return replace(transfer_function, modulation=None, graded=(), contours=())


def _largest_extinction(volume: Volume, transfer_function: TransferFunction) -> float:
    """The largest finite extinction that the volume's range of values can give, per world unit."""
    extinction = _most_medium(volume, transfer_function).extinction
    return float(extinction[np.isfinite(extinction)].max(initial=0.0))


def _most_medium(volume: Volume, transfer_function: TransferFunction) -> Classified:
    """Matter at the `_places` of the points, and what depends on the gradient at its most on top of each."""
    points = _points_alone(transfer_function).classify(_positions(volume, transfer_function))
    if not transfer_function.needs_gradient:
        return points
    modulation = transfer_function.modulation
    factor = 1.0 if modulation is None else float(modulation[:, 1].max())
    opaque = np.isinf(points.extinction)
    emission = points.emission * np.where(opaque, 1.0, factor)[:, np.newaxis]
    extinction = np.where(opaque, np.inf, np.where(opaque, 0.0, points.extinction) * factor)
    for graded in transfer_function.graded:
        emission = emission + graded.emissions.max(axis=0)
        extinction = extinction + graded.extinctions.max()
    for contour in transfer_function.contours:
        emission = emission + np.array(contour.emission)
        extinction = extinction + contour.extinction
    return Classified(emission, extinction)


def _positions(volume: Volume, transfer_function: TransferFunction) -> NDArray[np.float64]:
    """Values among which a texel's components have their largest: the ends of the range, the points, and in between.

    Between two points colour may fall while extinction rises, and their product peak between them: it is a parabola,
    which 32 positions between the points find to (1/64)² of the product of the two steps.
    """
    values = transfer_function.values
    # Beyond the first and the last point nothing changes, infinite values included.
    low, high = np.clip(volume.value_range or (values[0], values[-1]), values[0], values[-1])
    within = values[(values >= low) & (values <= high)]
    ends = distinct(np.concatenate([[low, high], within, np.nextafter(within, -np.inf)]))
    fractions = np.linspace(0, 1, 33)[:, np.newaxis]
    return (ends[:-1] * (1 - fractions) + ends[1:] * fractions).reshape(-1) if ends.size > 1 else ends


def _texel_scale(largest: NDArray[np.float64], dtype: np.dtype) -> NDArray[np.float64]:
    """Scale of texels, shape (4,). The colours share one scale, so that grey stays grey in 8 bits."""
    scale = np.array([largest[:3].max() or 1.0] * 3 + [largest[3] or 1.0])
    if dtype.kind == "f":
        # Floats need no range of their own: a power of two leaves every digit as it is.
        scale = np.exp2(np.ceil(np.log2(scale)))
    return scale


def _classified(
    values: NDArray, encode: Callable[[NDArray], NDArray], table: tuple[NDArray, int] | None, dtype: np.dtype
) -> NDArray:
    """`encode` of every sample, shape (nz, ny, nx, 4): by table for small integers, in threads for the rest."""
    flat = values.reshape(-1)
    texels = np.empty((flat.size, 4), dtype)
    work = partial(_look_up, flat, texels, *table) if table else partial(_compute, flat, texels, encode)
    in_threads(work, range(0, flat.size, _LOOKED_UP if table else _CHUNK))
    return texels.reshape(*values.shape, 4)


def _parts(depth: int, height: int, width: int) -> list[tuple[slice, slice]]:
    """Layers and rows of a box, no more parts than needed: each reads its neighbours' samples once more."""
    if depth * height * width <= _SMALLEST_PART:
        return [(slice(0, depth), slice(0, height))]
    layers = max(1, min(-(-depth // (os.cpu_count() or 1)), _LARGEST_PART // (height * width)))
    rows = max(1, min(height, _LARGEST_PART // width))
    return [
        (slice(z, min(z + layers, depth)), slice(y, min(y + rows, height)))
        for z in range(0, depth, layers)
        for y in range(0, height, rows)
    ]


def _look_up(values: NDArray, texels: NDArray, table: NDArray, low: int, start: int) -> None:
    # A texel is moved as one item of 4, 8 or 16 bytes: four times faster than as four numbers.
    item = np.dtype((np.void, 4 * table.itemsize))
    index = values[start : start + _LOOKED_UP].astype(np.intp) - low
    np.take(table.view(item)[:, 0], index, out=texels[start : start + _LOOKED_UP].view(item)[:, 0])


def _compute(values: NDArray, texels: NDArray, encode: Callable[[NDArray], NDArray], start: int) -> None:
    texels[start : start + _CHUNK] = encode(values[start : start + _CHUNK])
