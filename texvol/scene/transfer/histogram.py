"""Materials of a volume of which nothing is known, from the histogram of its values.

What is the background is left out (`matter_range`). In the logarithm of the smoothed counts of the rest each peak that
rises well above the valleys beside it is a material, as is a long tail after the last; the valleys are the boundaries.
Matter of one peak is parted by its quantiles, a wide range where its two sides differ most (Otsu 1979), and where there
are few levels each is a material.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from texvol.scene.transfer.pieces import LARGEST_VALUE, Numbers
from texvol.scene.transfer.units import medium_range, typical_samples
from texvol.scene.volume import Volume

_MOST_MATERIALS = 5  # as many as colours that one tells apart
_FEW_LEVELS = 16
_BINS = 128
_SMOOTHING = 2.0  # bins: standard deviation of the weights, narrower than any peak that is worth a material
_LEAST_PROMINENCE = 0.15  # of the logarithm: a peak stands 16% above the higher valley beside it
_SURE = 3.0  # standard deviations that a peak rises above the noise of its counts
_TAIL_STARTS = 0.05  # of the last peak's height
_LEAST_TAIL = 0.2, 2e-3  # fractions of the range and of the samples, from which on a tail is a material
_QUANTILES = 0.5, 0.85  # of a medium of one peak: half is the first material, the densest sixth the last
_LEAST_MASS = 0.01  # of the samples: less is no material of its own
_WIDE = 0.5  # of the range of the medium, from which on a material is parted as long as there are fewer than …
_ENOUGH = 3
_SOFT = 0.3  # of the narrower range beside a boundary, over which one material goes over into the other
_EXTINCTIONS = 3.0, 80.0  # of the first and the last material, per mean edge of the box
_ALONE = 30.0
_MOST_DEPTH = 3.0  # mean optical depth across the box of a material that others lie behind: it lets 5% through
_CONTOUR_THICKNESS = 1.5  # voxels
_CONTOUR_DEPTHS = 0.2, 0.4, 3.0  # optical depths of a contour met head-on: 18%, 33% and 95% opaque
_BOUNDARY_WEIGHT = 2.0  # a boundary is thinner than what it bounds
_BLURRED = 3.0  # voxels

# From what is thin and shows what lies behind it to what is dense.
_COLORS = {
    1: [(0.85, 0.60, 0.35)],
    2: [(0.62, 0.14, 0.06), (1.00, 0.86, 0.62)],
    3: [(0.10, 0.26, 0.50), (0.72, 0.20, 0.08), (1.00, 0.88, 0.66)],
    4: [(0.10, 0.26, 0.50), (0.62, 0.12, 0.06), (0.90, 0.52, 0.12), (1.00, 0.94, 0.82)],
    5: [(0.10, 0.26, 0.50), (0.12, 0.46, 0.34), (0.62, 0.12, 0.06), (0.90, 0.52, 0.12), (1.00, 0.94, 0.82)],
}


@dataclass(frozen=True)
class Regions:
    """Ranges of values that the histogram tells apart, data units."""

    background: float | None  # a value of the background, below all boundaries; None where there is no background
    boundaries: tuple[float, ...]  # where each material begins, ascending; the last has no end
    softness: tuple[float, ...]  # half the width over which each begins
    top: float  # the largest typical value
    fractions: tuple[float, ...]  # of all samples, those of each material


def content_for(volume: Volume) -> dict[str, Any]:
    """A transfer function of the volume's own materials, as a file has it; they are called material-1, material-2, …"""
    return {"length": "box", "materials": _materials(regions_of(volume))}


def contours_for(volume: Volume) -> dict[str, Any]:
    """Return up to three contours at the boundaries of the volume's materials, as in a file, the outer ones clearer."""
    regions = regions_of(volume)
    count = len(regions.boundaries)
    chosen = sorted({0, count // 2, count - 1})
    # The background is noise about one value, and the first contour keeps clear of it.
    values = [regions.boundaries[0] + regions.softness[0], *regions.boundaries[1:]]
    depths = _CONTOUR_DEPTHS[-len(chosen) :]
    unit = _CONTOUR_THICKNESS * volume.smallest_spacing  # what a ray goes through of a contour that it meets head-on
    return {
        "contours": [
            {
                "value": values[position],
                "thickness": _CONTOUR_THICKNESS,
                "color": list(color),
                "extinction": depth / unit,
            }
            for position, color, depth in zip(chosen, _COLORS[len(chosen)], depths, strict=True)
        ]
    }


def boundaries_for(volume: Volume) -> dict[str, Any]:
    """Boundaries between the volume's own materials, which are clear themselves, as a file has them."""
    regions = regions_of(volume)
    materials = _materials(regions)
    first = regions.boundaries[0]
    outside = regions.background if regions.background is not None else first
    # It is where the background ends that the first boundary begins: its noise has gradients, too.
    background = {"name": "background", "to": first, "color": [0, 0, 0], "extinction": 0}
    for each in materials:
        each["extinction"] *= _BOUNDARY_WEIGHT
    typical = [outside, *((start + end) / 2 for start, end in pairwise((*regions.boundaries, regions.top)))]
    names = [background["name"], *(each["name"] for each in materials)]
    blurred = _BLURRED * volume.smallest_spacing
    boundaries = [
        # A step that the scanner has blurred over some voxels is all there.
        {"materials": [*pair], "gradient": min(max((b - a) / blurred, 1e-300), LARGEST_VALUE)}
        for pair, a, b in zip(pairwise(names), typical, typical[1:], strict=False)
    ]
    return {"length": "box", "materials": [background, *materials], "show": [], "boundaries": boundaries}


def regions_of(volume: Volume) -> Regions:
    """Ranges of values, one to five, that the histogram of a volume separates."""
    samples = typical_samples(volume)
    largest = max(float(np.abs(samples).max()), 1e-300)  # values up to 1e308 have no range that float64 could hold
    samples = samples / largest
    levels = np.unique(samples)
    if levels.size <= _FEW_LEVELS:
        found = _regions_of_levels(levels)
    else:
        low, high = (each / largest for each in medium_range(volume))
        found = _regions_between(samples, low, high)
    background, starts, top = found
    # Ramps beside the values have to be values, too.
    most = 0.5 * LARGEST_VALUE / largest
    starts, top = np.unique(np.clip(starts, -most, most)), float(np.clip(top, -most, most))
    ends = np.append(starts[1:], max(top, starts[-1]))
    widths = ends - starts
    narrower = np.minimum(widths, np.append(widths[0], widths[:-1]))
    return Regions(
        None if background is None else float(np.clip(background, -most, most)) * largest,
        tuple((starts * largest).tolist()),
        tuple((narrower * _SOFT * largest).tolist()),
        top * largest,
        tuple(np.histogram(samples, [*starts, np.inf])[0] / samples.size),
    )


def _materials(regions: Regions) -> list[dict[str, Any]]:
    count = len(regions.boundaries)
    extinctions = np.geomspace(*_EXTINCTIONS, count) if count > 1 else np.array([_ALONE])
    # What there is much of would hide what is denser.
    extinctions[:-1] = np.minimum(extinctions[:-1], _MOST_DEPTH / np.maximum(regions.fractions[:-1], 1e-9))
    ramps = [[start - soft, start + soft] for start, soft in zip(regions.boundaries, regions.softness, strict=True)]
    ramps[0][0] = regions.boundaries[0]  # the first begins after the background, not within it
    ends = [{"to": ramp} for ramp in ramps[1:]] + [{}]
    return [
        {"name": f"material-{number + 1}", "from": ramp, **end, "color": list(color), "extinction": float(extinction)}
        for number, (ramp, end, color, extinction) in enumerate(
            zip(ramps, ends, _COLORS[count], extinctions, strict=True)
        )
    ]


def _regions_of_levels(levels: Numbers) -> tuple[float | None, Numbers, float]:
    """Each level is a material, but for the lowest, which is the background; many levels are parted evenly."""
    if levels.size == 1:
        return None, levels, float(levels[0])
    starts = (levels[:-1] + levels[1:]) / 2
    if starts.size > _MOST_MATERIALS:
        starts = starts[np.linspace(0, starts.size, _MOST_MATERIALS, endpoint=False).astype(int)]
    return float(levels[0]), starts, float(levels[-1])


def _regions_between(samples: Numbers, low: float, high: float) -> tuple[float | None, Numbers, float]:
    """Materials among the samples from `low`, where the background ends, to `high`."""
    medium = samples[(samples > low) & (samples <= high)]
    below = samples[samples <= low]
    background = float(np.median(below)) if below.size else None
    if medium.size < 2 or not medium[-1] > medium[0]:
        return background, np.array([low]), high
    starts = _massive(medium, np.append(low, _valleys(medium, low, high)))
    if starts.size == 1:
        starts = np.append(low, np.quantile(medium, _QUANTILES))
    while starts.size < _ENOUGH:
        ends = np.append(starts[1:], high)
        widest = int(np.argmax(ends - starts))
        inside = medium[(medium > starts[widest]) & (medium <= ends[widest])]
        if ends[widest] - starts[widest] < _WIDE * (high - low) or inside.size < 2 or inside[0] == inside[-1]:
            break
        starts = np.insert(starts, widest + 1, _parted(inside))
    return background, np.unique(starts), high


def _massive(medium: Numbers, starts: Numbers) -> Numbers:
    """Without the starts of materials that hardly any sample has; they go to the one below."""
    while starts.size > 1:
        masses = np.histogram(medium, [*starts, np.inf])[0] / medium.size
        least = int(np.argmin(masses))
        if masses[least] >= _LEAST_MASS:
            break
        starts = np.delete(starts, max(least, 1))
    return starts


def _parted(samples: Numbers) -> float:
    """Value that parts ascending samples so that the variance between the two sides is largest."""
    below = np.arange(1, samples.size)
    sums = np.cumsum(samples)
    means = sums[:-1] / below, (sums[-1] - sums[:-1]) / (samples.size - below)
    between = np.where(np.diff(samples) > 0, below * (samples.size - below) * (means[1] - means[0]) ** 2, 0.0)
    best = int(np.argmax(between))
    return float(samples[best] / 2 + samples[best + 1] / 2)


def _valleys(medium: Numbers, low: float, high: float) -> Numbers:
    """Values between neighbouring peaks of the histogram, and where a long tail begins."""
    edges = _edges(medium, low, high)
    counts = np.histogram(medium, edges)[0].astype(np.float64)
    smooth = _smoothed(counts)
    height = np.log(smooth + 1)
    peaks = _peaks(height, smooth)
    positions = [int(first + np.argmin(height[first : last + 1])) for first, last in pairwise(peaks)]
    last = peaks[-1]
    ended = np.flatnonzero(smooth[last:] < _TAIL_STARTS * smooth[last])
    if ended.size and len(peaks) < _MOST_MATERIALS:
        tail = last + int(ended[0])
        fraction, samples = 1 - tail / counts.size, counts[tail:].sum() / medium.size
        if fraction >= _LEAST_TAIL[0] and samples >= _LEAST_TAIL[1]:
            positions.append(tail)
    middles = (edges[:-1] + edges[1:]) / 2
    return np.asarray(middles[positions])


def _edges(medium: Numbers, low: float, high: float) -> Numbers:
    """Edges of bins that hold the same number of levels each, where the samples are few levels of equal distance."""
    levels = np.unique(medium)
    if levels.size > 4 * _BINS:
        return np.linspace(low, high, _BINS + 1)
    step = float(np.diff(levels).min())
    width = step * np.ceil((high - low) / step / _BINS)
    count = int(np.ceil((high - low) / width)) if width > 0 else _BINS
    return np.linspace(low, high, _BINS + 1) if not 1 <= count <= _BINS else low + width * np.arange(count + 1)


def _smoothed(counts: Numbers) -> Numbers:
    reach = int(3 * _SMOOTHING)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / _SMOOTHING) ** 2)
    padded = np.pad(counts, reach, mode="edge")
    return np.convolve(padded, weights / weights.sum(), mode="valid")


def _peaks(height: Numbers, smooth: Numbers) -> list[int]:
    """Bins of the most prominent peaks, ascending, the highest of all among them."""
    rises = np.diff(np.concatenate([[-np.inf], height, [-np.inf]]))
    tops = np.flatnonzero((rises[:-1] > 0) & (rises[1:] <= 0))
    prominent = [(_prominence(height, int(top)), int(top)) for top in tops]
    # A count of n is off by √n, and smoothing is the mean of about 2 √π of its standard deviations.
    noise = _SURE / np.sqrt((smooth + 1) * 2 * np.sqrt(np.pi) * _SMOOTHING)
    sure = [(much, top) for much, top in prominent if much > max(_LEAST_PROMINENCE, float(noise[top]))]
    return sorted(top for _, top in sorted(sure, reverse=True)[:_MOST_MATERIALS])


def _prominence(height: Numbers, top: int) -> float:
    """Prominence of a peak: the least descent between them to a higher one; infinite for the highest peak."""
    sides = []
    for side in (height[:top][::-1], height[top + 1 :]):
        higher = np.flatnonzero(side > height[top])
        if higher.size:
            sides.append(float(side[: higher[0]].min(initial=height[top])))
    return height[top] - max(sides) if sides else np.inf
