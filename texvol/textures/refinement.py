"""Choice of the grid that texels are classified on: as fine as shows, within limits of memory and time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.refinement import REFINEMENTS, beyond_refinement, interpolated
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.slab_texture import texel_classifier
from texvol.textures.texel_format import discretisation_per_voxel
from texvol.util.statistics import rms

_POINTS = 4096  # at which the media are compared
_SECONDS = 0.3  # that texels may take to be made
_TEXELS_PER_SECOND = 25e6  # interpolated and classified on two cores; scripts/benchmark.py --only bake
_BYTES = 4 + 16  # of a refined value and its texel, at most
_HIDDEN = 1 / 4  # of the discretisation error
_ROUNDING = 1e-7  # of a texel


def chosen_refinement(scene: CompleteScene, slab_thickness: float, most_bytes: float) -> int:
    """Return the least refinement whose model error hides in that of the slabs; or the best there is room for.

    Parameters
    ----------
    scene : CompleteScene
        Of classification slab or extinction.
    slab_thickness : float
        World units.
    most_bytes : float
        Bytes of a quarter of the budget of textures.
    """
    volume = scene.volume
    if beyond_refinement(scene):
        return 1
    room = min(most_bytes / _BYTES, _SECONDS * _TEXELS_PER_SECOND)
    possible = [each for each in REFINEMENTS if each == 1 or volume.size * each**3 <= room]
    if possible == [1]:
        return 1
    of_slabs = discretisation_per_voxel(volume, scene.medium, scene.classification, slab_thickness)
    if not of_slabs.size:
        return 1
    discretisation = rms(of_slabs)
    voxels = float(np.mean(volume.dimensions))
    errors: dict[int, float] = {}
    for factor in possible:
        moved = model_error_per_voxel(volume, scene.medium, factor)
        if not moved.size:
            return 1
        # What has one sign along a ray adds up over all voxels, what has not over the root of their number.
        errors[factor] = rms(moved) + float(np.abs(moved.mean(axis=0)).max(initial=0.0)) * np.sqrt(voxels)
        if errors[factor] <= max(_HIDDEN * discretisation, _ROUNDING):
            break
    # A finer grid bends where it has samples, and not where the volume has: it may be the worse one.
    return min(errors, key=lambda factor: errors[factor])


def model_error_per_voxel(volume: Volume, transfer_function: TransferFunction, factor: int) -> NDArray[np.float64]:
    """Return by how much interpolated texels differ from classified values, at points of the box, shape (n, 4).

    They are colour and opacity of a slab of the smallest spacing, where anything is there.
    """
    classify = texel_classifier(transfer_function, "slab", volume.smallest_spacing, np.inf)
    count = np.array(volume.dimensions)
    # Multiples of 1/g, 1/g², 1/g³ with g⁴ = g + 1 fill the cube evenly (Roberts 2018, R3).
    numbers = np.arange(1, _POINTS + 1)[:, np.newaxis] * 1.2207440846057596 ** -np.arange(1.0, 4.0) % 1
    finer = numbers * count * factor - 0.5
    low = np.floor(finer)
    fraction = finer - low
    texels = np.zeros((_POINTS, 4))
    for corner in range(8):
        bits = corner >> np.arange(3) & 1
        # Beyond its samples a texture goes on as it ends.
        sample = np.clip(low + bits, 0, count * factor - 1)
        weight = np.where(bits, fraction, 1 - fraction).prod(axis=1)
        texels += weight[:, np.newaxis] * classify(interpolated(volume.values, (sample + 0.5) / factor - 0.5))
    truth = classify(interpolated(volume.values, numbers * count - 0.5))
    shows = (texels != 0).any(axis=1) | (truth != 0).any(axis=1)
    return (texels - truth)[shows]
