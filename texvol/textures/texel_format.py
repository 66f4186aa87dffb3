"""The smallest texel format whose rounding does not show beside the discretisation error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import Classification
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures import value_texture
from texvol.textures.slab_texture import TEXEL_TYPES, Classifier, texel_classifier
from texvol.textures.value_storage import spread_samples
from texvol.util.statistics import on_steps, rms

EXACT_VALUES = "exact"
_LEAST_WIDTH = 1 / 1024  # of a line between two control points, in ranges of the values: 64 of 65536 steps
_LARGE = 1 << 28  # bytes of a float32 texture: making and holding one that is larger takes more than drawing it
_INVISIBLE = 1 / 4096  # of a picture's range: a sixteenth of a step of 8 bits
_STENCILS = 4096  # voxels looked at, each with its six neighbours


def cheapest_texel_format(
    volume: Volume, transfer_function: TransferFunction, classification: Classification, slab_thickness: float
) -> str:
    """The smallest texel format whose rounding stays under a quarter of the discretisation error.

    Both are estimated per voxel of a ray, on voxels spread evenly. With texels t in units of the smallest
    spacing h, second differences Δ²t and first differences Δt between neighbours:

    - The midpoint rule misses a kink of trilinear interpolation by about 0.06 Δ²t (d/h)² (rms over where in a slab
      the kink lies; it is between -1/12 and 1/24 of the change in slope times d²).
    - Interpolating opacity instead of extinction misses the depth by (d Δt)² / 12 in each of h/d slabs.
    - Rounding moves a texel by its distance to the nearest number of the format; what has one sign along the ray
      adds up over all n voxels, what has not over √n of them.

    Where a float32 texture would be large, rounding that moves a picture by less than 1/4096 is taken as well.

    For `post` it is that of values: 16 bits, or as they are; for `integrated` always as they are. Where the medium
    depends on the gradient nothing is estimated, and nothing rounded.
    """
    if classification == "integrated":
        return EXACT_VALUES
    classifier = texel_classifier(transfer_function, "extinction", volume.smallest_spacing, np.inf)
    if transfer_function.needs_gradient and classification != "post":
        return "rgba32f"
    if classification == "post":
        return _cheapest_value_format(volume, transfer_function, classifier, slab_thickness)
    texels, finite = _stencil_texels(volume, classifier)
    if not texels.size:
        return "rgba8" if finite.any() else "rgba32f"
    middle = texels[:, :1]
    discretisation = _discretisation(texels, classification, slab_thickness / volume.smallest_spacing)
    scale = texels.max(axis=(0, 1))
    scale[:3] = scale[:3].max()
    is_large = float(volume.size) * 16 > _LARGE
    for texel_format in ("rgba8", "rgba16f"):
        rounding = _rounded(middle, scale, texel_format) - middle
        if _hides(rounding, discretisation, volume) or (is_large and _is_invisible(rounding, volume)):
            return texel_format
    return "rgba32f"


def discretisation_per_voxel(
    volume: Volume, transfer_function: TransferFunction, classification: Classification, slab_thickness: float
) -> NDArray[np.float64]:
    """Estimate the discretisation error in a voxel of a ray, as `cheapest_texel_format` does; 0 where nothing is."""
    classifier = texel_classifier(transfer_function, "extinction", volume.smallest_spacing, np.inf)
    texels, _ = _stencil_texels(volume, classifier)
    return _discretisation(texels, classification, slab_thickness / volume.smallest_spacing)


def _stencil_texels(volume: Volume, classifier: Classifier) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Texels of voxels and their neighbours, (voxels, 7, 4), where something finite is; and which voxels are finite."""
    values = _stencil_values(volume)
    with np.errstate(invalid="ignore"):
        texels = classifier(values.reshape(-1)).reshape(*values.shape, 4)
    finite = np.asarray(np.isfinite(texels).all(axis=(1, 2)))
    return texels[finite & (texels != 0).any(axis=(1, 2))], finite


def _discretisation(texels: NDArray[np.float64], classification: Classification, d: float) -> NDArray[np.float64]:
    middle, before, after = texels[:, :1], texels[:, 1::2], texels[:, 2::2]
    discretisation = 0.06 * (after - 2 * middle + before) * d**2
    if classification == "slab":
        discretisation = np.abs(discretisation) + ((after - before) / 2) ** 2 * d / 12
    return discretisation


def _cheapest_value_format(
    volume: Volume, transfer_function: TransferFunction, classifier: Classifier, slab_thickness: float
) -> str:
    """Values in 16 bits where that is half the memory and their rounding hides; near a step it never does.

    Nor where it makes something of nothing, in more than a few places: there would be little to skip over.
    """
    span = value_texture.span_in_16_bits(volume)
    widths = np.diff(transfer_function.values)
    if span is None or np.isinf(transfer_function.extinctions).any() or (widths < _LEAST_WIDTH * span).any():
        return EXACT_VALUES
    values = _stencil_values(volume).astype(np.float64)
    texels = classifier(values.reshape(-1)).reshape(*values.shape, 4)
    assert volume.finite_range is not None
    low, step = volume.finite_range[0], span / 65535
    rounded = classifier(on_steps(values, low, step).reshape(-1)).reshape(texels.shape)
    seen, seen_rounded = ((each != 0).any(axis=2) for each in (texels, rounded))
    shows = seen.any(axis=1)
    if not shows.any() or (seen_rounded & ~seen).any():
        return EXACT_VALUES
    middle, before, after = texels[shows, :1], texels[shows, 1::2], texels[shows, 2::2]
    discretisation = 0.06 * (after - 2 * middle + before) * (slab_thickness / volume.smallest_spacing) ** 2
    return "r16" if _hides(rounded[shows, 0] - middle[:, 0], discretisation, volume) else EXACT_VALUES


def _hides(rounding: NDArray, discretisation: NDArray, volume: Volume) -> bool:
    """True if the rounding along a ray stays under a quarter of the discretisation error."""
    of_one_sign = np.abs(rounding.mean(axis=0)).max() * np.sqrt(float(np.mean(volume.dimensions)))
    return bool(rms(rounding) + of_one_sign <= rms(discretisation) / 4)


def _is_invisible(rounding: NDArray, volume: Volume) -> bool:
    """True if the rounding of all voxels along a ray moves a picture by less than a small part of a step of 8 bits."""
    voxels = float(np.mean(volume.dimensions))
    of_one_sign = np.abs(rounding.mean(axis=0)).max() * voxels
    return bool(rms(rounding) * np.sqrt(voxels) + of_one_sign <= _INVISIBLE)


def _stencil_values(volume: Volume) -> NDArray:
    """Values of spread voxels and their neighbours: (voxels, 7), the voxel, then before and after along x, y, z."""
    voxels = spread_samples(volume, _STENCILS)
    offsets = np.array([(0, 0, 0), *(sign * step for step in np.eye(3, dtype=int) for sign in (-1, 1))])
    x, y, z = np.moveaxis(np.clip(voxels[:, np.newaxis] + offsets, 0, np.array(volume.dimensions) - 1), 2, 0)
    return volume.values[z, y, x]


def _rounded(texels: NDArray, scale: NDArray, texel_format: str) -> NDArray:
    fraction = np.divide(texels, scale, out=np.zeros_like(texels), where=scale > 0)
    if texel_format == "rgba8":
        # Drivers filter 8-bit texels in 8 bits too, which loses about as much again at either step.
        return texels + 3 * (np.rint(fraction * 255) / 255 - fraction) * scale
    return fraction.astype(TEXEL_TYPES[texel_format]).astype(np.float64) * scale
