"""Kind of the data of a volume: what its file says of it, or what its values look like.

The statistics are those of at most 65,536 samples, of a coarse level where the volume is in a store. A kind is a guess
for the first picture: each has a reason that can be shown, and what is in doubt is `measured`.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.air import hounsfield_by
from texvol.scene.dark_objects import mirrored
from texvol.scene.distances import depth_inside
from texvol.scene.noise import LEAST_NOISE, MOST_NOISE, noise_of
from texvol.scene.spaces import letters_of_space
from texvol.scene.transfer.units import medium_range, typical_samples
from texvol.scene.volume import LARGEST_LABEL, Volume
from texvol.util.errors import InputError
from texvol.util.statistics import distinct, histogram, percentile_of_sorted

KindName = Literal[
    "labels",
    "colours",
    "fluorescence",
    "CT",
    "MR",
    "distance",
    "signed",
    "dark",
    "noise",
    "field",
    "measured",
    "constant",
]

_MOST_LEVELS = 1024  # different values that labels may have: an atlas of a brain has some 200
_FEW_LEVELS = 8  # of so few, neighbours may have any names
_ALIKE_OF_FEW, _ALIKE = 0.5, 0.65  # least fraction of neighbours with one label, outside of the background
_ALONG_AN_AXIS = 0.6  # of that, along an axis on which samples lie farther apart
_FAR_APART = 0.15  # least fraction of borders at which a field would have jumped over a level
_FEWEST_IN_ORDER = 4  # levels of a field that was made coarse
_FAR_APART_OF_FEW = 0.05  # such a field jumps over a level nowhere, and labels touch the background here and there
_LOOKED_AT = 1 << 20  # samples whose neighbours are compared
_SKEWED = 0.35  # standardised third moment, of either sign
_BACKGROUND = 0.1  # fraction of the samples of a head that air has around it, at least
_BOTH_SIGNS = 0.05  # least fraction of what is not near zero, on either side
_NEAR_ZERO = 0.02  # of the largest magnitude
_EVEN = 0.2  # least ratio of the two ends of a field with two signs
_DARK = 0.15  # of the range of the medium, below which half of a fluorescent image lies
_ANGSTROMS = ("Å", "A")
_FILLED = 0.35  # of the range, above which half of a field lies
_MICROMETRES = ("µm", "um", "μm", "micron", "microns", "micrometer", "micrometre", "nm", "nanometer", "nanometre")

_KINDS: WeakKeyDictionary[Volume, Kind] = WeakKeyDictionary()
_AS_LABELS: WeakKeyDictionary[Volume, Volume] = WeakKeyDictionary()


@dataclass(frozen=True)
class Kind:
    """Kind of data, and the reason for it, a sentence without its full stop."""

    name: KindName
    reason: str


def kind_of(volume: Volume) -> Kind:
    """Return the kind of a volume's data."""
    if volume not in _KINDS:
        _KINDS[volume] = _told(volume) or _seen(volume)
    return _KINDS[volume]


def as_labels(volume: Volume) -> Volume:
    """Return the volume with its values as labels, which are never interpolated; the same object each time.

    Raises
    ------
    InputError
        If a value is not whole, or too large.
    """
    if volume.labels:
        return volume
    if volume in _AS_LABELS:
        return _AS_LABELS[volume]
    seen = volume.overview.values
    if seen.dtype.kind == "f" and not (np.isfinite(seen).all() and (seen == np.rint(seen)).all()):
        raise InputError(f"{volume.name}: labels must be whole numbers, got fractions or NaN")
    other = copy(volume)
    for derived in ("overview", "whole"):
        other.__dict__.pop(derived, None)
    other.labels = True
    other.source = {**volume.source, "labels": True} if volume.source else {}
    if volume in _KINDS:
        _KINDS[other] = _KINDS[volume]  # and so its reason
    _AS_LABELS[volume] = other
    return other


def _told(volume: Volume) -> Kind | None:
    """Return the kind that the volume has by its file, without a look at its values."""
    if volume.labels:
        return Kind("labels", "its values are labels")
    if volume.colors is not None:
        return Kind("colours", "each sample has its own colour")
    if getattr(volume, "channel", None) is not None:
        return Kind("fluorescence", "it is a channel of an image of several")
    return None


def _seen(volume: Volume) -> Kind:
    """Return the kind that the values look like."""
    ends = volume.finite_range
    if ends is None or not ends[1] > ends[0]:
        return Kind("constant", "all of its values are the same" if ends else "none of its values is finite")
    samples = typical_samples(volume)
    is_dark = mirrored(volume) is not None
    if levels := _label_levels(volume, samples, is_dark):
        return Kind("labels", f"its values are {levels} whole numbers in patches of one number each")
    low, high = ends
    if by := hounsfield_by(volume):
        known = "the file says that its values are Hounsfield units"
        return Kind("CT", known if by == "file" else f"its values are like Hounsfield units, {low:g} to {high:g}")
    if depth_inside(volume) is not None:
        return Kind("distance", "its gradient has one length everywhere, as that of a signed distance has")
    if _has_two_signs(volume, samples):
        return Kind("signed", f"its values have two signs about zero, {low:g} to {high:g}")
    if is_dark:
        return Kind("dark", "what is in it is darker than the background around it")
    is_density = volume.unit in _ANGSTROMS  # of a molecule, whose surface lies above the noise
    if not is_density and LEAST_NOISE <= (noise := noise_of(volume)) <= MOST_NOISE:
        return Kind("noise", f"{noise:.0%} of the variance of its values is noise, which evens out where light adds up")
    skewness, median, background = _shape(volume, samples)
    if volume.unit.strip().lower() in _MICROMETRES and median < _DARK and skewness > 1:
        return Kind("fluorescence", f"few of its values are bright, and its unit is {volume.unit}")
    anatomical = letters_of_space(volume.space) is not None
    if anatomical and low >= 0 and background >= _BACKGROUND and abs(skewness) >= _SKEWED:
        return Kind("MR", f"the file names directions of the body, and its histogram is skewed by {skewness:.1f}")
    is_tissue = anatomical and volume.dtype.kind != "f"  # a part of a body, cut out
    if not is_density and not is_tissue and background < _BACKGROUND and median > _FILLED:
        return Kind("field", "its values fill the box, without a background")
    return Kind("measured", "nothing says what its values are")


def _label_levels(volume: Volume, samples: NDArray[np.float64], is_dark: bool) -> int:
    """Return the number of different values if they look like labels, else 0; of dark objects before a background too.

    Labels are whole numbers in patches: most neighbours have the same one. A field of few levels is in patches too, but
    from one patch to the next it goes by one level; labels beside each other have any numbers.
    """
    levels = distinct(samples)
    if volume.value_unit or not 2 <= levels.size <= _MOST_LEVELS or not (levels == np.rint(levels)).all():
        return 0
    if levels[0] < 0 or levels[-1] > LARGEST_LABEL or (is_dark and levels.size == 2):
        return 0
    values = volume.overview.values
    step = max(-(-values.size // _LOOKED_AT), 1)
    planes = values[::step]
    if planes.dtype.kind == "f" and not (np.isfinite(planes).all() and (planes == np.rint(planes)).all()):
        return 0
    beside = values[1::step]
    pairs = [(planes[:, :, :-1], planes[:, :, 1:]), (planes[:, :-1], planes[:, 1:]), (planes[: len(beside)], beside)]
    return int(levels.size) if _in_patches(levels, pairs, levels[[0, -1]] if is_dark else levels[:1]) else 0


def _in_patches(
    levels: NDArray[np.float64], pairs: list[tuple[NDArray, NDArray]], background: NDArray[np.float64]
) -> bool:
    """Return True if neighbours along each axis are mostly alike, and others not mostly of neighbouring levels.

    Neighbours of which one is of a level of the background have no say in the first.
    """
    alike = _ALIKE if levels.size > _FEW_LEVELS else _ALIKE_OF_FEW if levels.size > 2 else 0.0
    all_within = all_alike = borders = far = 0
    for one, other in pairs:
        within = ~(np.isin(one, background) | np.isin(other, background))
        differs = one != other
        same, count = int((within & ~differs).sum()), int(within.sum())
        if same < _ALONG_AN_AXIS * alike * count:
            return False
        all_within, all_alike = all_within + count, all_alike + same
        ranks = [np.searchsorted(levels, side[differs]) for side in (one, other)]
        borders, far = borders + ranks[0].size, far + int((np.abs(ranks[0] - ranks[1]) > 1).sum())
    if not all_within or all_alike < alike * all_within:
        return False
    if levels.size <= _FEW_LEVELS:
        return levels.size <= _FEWEST_IN_ORDER or far >= _FAR_APART_OF_FEW * borders
    return far >= _FAR_APART * borders


def _has_two_signs(volume: Volume, samples: NDArray[np.float64]) -> bool:
    """True for a field about zero: both signs are there and reach about as far, and zero is not far from the mode."""
    if volume.unit in _ANGSTROMS or volume.dtype.kind == "u":  # a density of a molecule: what is below zero is noise
        return False
    samples = samples / max(float(np.abs(samples).max()), 1e-300)  # values up to 1e308 have no range
    low, high = percentile_of_sorted(samples, (0.5, 99.5)).tolist()
    most = max(-low, high)
    if not (low < 0 < high and min(-low, high) >= _EVEN * most):
        return False
    large = samples[np.abs(samples) > _NEAR_ZERO * most]
    below = float((large < 0).mean())
    counts, edges = histogram(samples, 32, (low, high))
    mode = float(edges[counts.argmax()] + edges[counts.argmax() + 1]) / 2
    lies_low = counts.max() >= samples.size / 4 and mode < low / 2  # a background at the low end, as of scaled images
    return min(below, 1 - below) >= _BOTH_SIGNS and not lies_low


def _shape(volume: Volume, samples: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return skewness and median of the medium, the latter in its range, and the fraction of the background."""
    largest = max(float(np.abs(samples).max()), 1e-300)
    low, high = (end / largest for end in medium_range(volume))
    samples = samples / largest
    medium = samples[samples > low]
    if medium.size < 2 or not medium[-1] > medium[0] or not high > low:
        return 0.0, 0.0, 0.0
    scaled = np.minimum((medium - low) / (high - low), 2.0)
    deviation = float(scaled.std())
    skewness = float((((scaled - scaled.mean()) / deviation) ** 3).mean()) if deviation > 0 else 0.0
    return skewness, float(scaled[scaled.size // 2]), 1 - medium.size / samples.size
