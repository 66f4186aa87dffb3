"""Regions that several large volumes have in common: boxes of one grid around all, and the samples of each in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from texvol.scene.added_volume import common_box
from texvol.scene.large_volume import Box, LargeVolume, Level
from texvol.slicing.bricks import Triple
from texvol.slicing.regions import Region, few_of_level, most_samples_of, regions_of

_ROUNDING = 1e-6  # samples


@dataclass(frozen=True)
class CommonRegions:
    """Regions of a box around some volumes, and what each of them has there.

    Attributes
    ----------
    frame : LargeVolume
        The box, with axes of the first volume, of samples that are nowhere; regions are of these.
    regions : list of Region
    own : list of dict
        Of each volume: samples of its level 0 in a region, by the region's position; none where they do not meet.
    ends : list of set
        Of each volume: positions of the regions in which pieces of rays end at its box, or at its labels.
    """

    frame: LargeVolume
    regions: list[Region]
    own: list[dict[Triple, Region]]
    ends: list[set[Triple]]


def common_regions(
    volumes: Sequence[LargeVolume],
    levels: Sequence[int],
    margins: Sequence[NDArray[np.float64]],
    most_samples: float = np.inf,
) -> CommonRegions:
    """Return the regions in which volumes are drawn together, each from one of its levels.

    The samples of the box lie as close as those of any volume along its axes. Memory for them is that of the first
    volume, and each volume has its share of it. A volume is in a region if it comes as close as its margin, samples of
    level 0 along x, y, z: slabs whose middles lie there may reach so far. Regions have at most `most_samples` of the
    box, if their sides allow.
    """
    frame = frame_of(volumes, levels)
    few = few_of_level(max(levels))
    regions = regions_of(frame.dimensions, min(most_samples_of(frame), most_samples), few)
    found = CommonRegions(frame, regions, [], [])
    for volume, margin in zip(volumes, margins, strict=True):
        own, inside = _own_regions(frame, regions, volume, margin)
        found.own.append(own)
        found.ends.append(set(own) if volume.nearest else set(own) - inside)
    return found


def frame_of(volumes: Sequence[LargeVolume], levels: Sequence[int]) -> LargeVolume:
    """Return a volume without samples: the box around all, cut as finely as the levels of the volumes are."""
    box = common_box(volumes)
    axes = box.direction
    extent = box.spacing
    if len(volumes) == 1:
        axes, extent = box.direction, box.spacing * box.dimensions
    per_unit = np.zeros(3)
    for volume, number in zip(volumes, levels, strict=True):
        samples = np.abs(volume.index_from_world @ axes) / np.array(volume.levels[number].factor)[:, np.newaxis]
        per_unit = np.maximum(per_unit, samples.max(axis=0))
    nx, ny, nz = (max(int(np.ceil(each - _ROUNDING)), 1) for each in extent * per_unit)
    spacing = extent / (nx, ny, nz)
    origin = box.centre + axes @ (spacing / 2 - extent / 2)
    widest = max((volume.dtype for volume in volumes), key=lambda dtype: dtype.itemsize)
    frame = LargeVolume([Level(_Nowhere((nz, ny, nx), widest))], spacing, origin, axes, memory=share_of(volumes))
    if (cut_for := volumes[0].cut_for) is not None:
        frame.cut_for = cut_for // len(volumes)
    return frame


def share_of(volumes: Sequence[LargeVolume]) -> int:
    """Return the bytes of memory that each of some volumes has, which are drawn together."""
    return min(volume.memory for volume in volumes) // len(volumes)


def _own_regions(
    frame: LargeVolume, regions: Sequence[Region], volume: LargeVolume, margin: NDArray[np.float64]
) -> tuple[dict[Triple, Region], set[Triple]]:
    """Return the samples of a volume around each region, by the region's position; and which of these its box holds."""
    boxes = np.array([(each.first, each.last) for each in regions]) - 0.5  # in indices of the frame
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    to_own = volume.index_from_world @ frame.world_from_index
    start = volume.index_from_world @ (frame.origin - volume.origin)
    corners = start + boxes[:, bits, np.arange(3)] @ to_own.T
    low = np.floor(corners.min(axis=1) + 0.5 + _ROUNDING)
    high = np.ceil(corners.max(axis=1) + 0.5 - _ROUNDING)
    meets = ((low < np.array(volume.dimensions) + margin) & (high > -margin)).all(axis=1)
    first = np.clip(low, 0, np.array(volume.dimensions) - 1).astype(int)
    last = np.clip(high, first + 1, volume.dimensions).astype(int)
    inside = ((low - margin >= 0) & (high + margin <= np.array(volume.dimensions))).all(axis=1)
    own = {
        region.position: Region(region.position, _triple(a), _triple(b))
        for region, a, b, meeting in zip(regions, first, last, meets, strict=True)
        if meeting
    }
    return own, {region.position for region, holds in zip(regions, inside, strict=True) if holds}


@dataclass(frozen=True)
class _Nowhere:
    """Source of samples that nobody reads."""

    shape: Triple
    dtype: np.dtype
    chunk_shape: Triple = (1, 1, 1)
    bytes_read: int = 0

    def read(self, box: Box) -> NoReturn:
        raise AssertionError("a frame has no samples")


def _triple(numbers: NDArray[np.intp]) -> Triple:
    x, y, z = (int(number) for number in numbers)
    return x, y, z
