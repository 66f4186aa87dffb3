"""Measures of the difference of two pictures: absolute differences, and perceptual measures.

All are of linear light with premultiplied colour. `ssim` is the structural similarity of the luminance (Wang, Bovik,
Sheikh, Simoncelli 2004), `flip` the mean of FLIP (Andersson et al. 2020), computed by OpenImageIO from the displayed
pictures.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.pictures import Picture

_WEIGHTS = np.array([0.2126, 0.7152, 0.0722, 0], np.float32)  # luminance of linear sRGB (IEC 61966-2-1)
_SIGMA, _REACH = 1.5, 5  # pixels; window and constants of SSIM are those of its authors
_SSIM_CONSTANTS = 0.01**2, 0.03**2  # for a range of 1
# A few roundings of numbers of about 1: decoding 8 bits, encoding them, float32 itself.
_SLACK = 1e-6


@dataclass(frozen=True)
class Channelwise:
    """Absolute differences over all pixels of some channels; infinite if a number is NaN or infinite.

    `psnr` is in decibels, for a peak of 1; infinite for equal pictures. Percentiles are those of each pixel's largest
    channel.
    """

    max_error: float
    rms_error: float
    mean_error: float
    psnr: float
    percentile_99: float
    percentile_99_9: float


@dataclass(frozen=True, kw_only=True)
class Measures:
    """All measures of a pair, by default of equal pictures; numbers without a part's name are those of all channels.

    Attributes
    ----------
    parts : dict
        `Channelwise` of "all" channels, premultiplied "color" and, if both have it, "opacity".
    beyond_max, beyond_rms : float
        Largest and rms difference beyond the rounding of number formats, which limits apply to.
    outlier : float
        Largest distance of a pixel from the range of its neighbourhood in the other picture, beyond rounding.
    percent_over : float
        Percentage of pixels that differ by more than `limit` beyond rounding.
    ssim, flip : float
    flip_weighted_median : float
        Weighted median of FLIP: of the pixels with a difference, however few they are.
    beyond_flip : float
        FLIP of the difference beyond rounding; 0 for pictures of numbers, which are not displayed as they are.
    worst_pixel : (column, row)
    worst_values : pair of (r, g, b, a)
        The candidate's and the reference's pixel there.
    non_finite : int
        Pixels with a NaN or an infinity in either picture.
    scale : float
        Unit of the differences: 1, or the range of pictures of numbers.
    """

    parts: dict[str, Channelwise]
    beyond_max: float = 0.0
    beyond_rms: float = 0.0
    outlier: float = 0.0
    limit: float
    percent_over: float = 0.0
    ssim: float = 1.0
    flip: float = 0.0
    flip_weighted_median: float = 0.0
    beyond_flip: float = 0.0
    worst_pixel: tuple[int, int] = (0, 0)
    worst_values: tuple[tuple[float, ...], tuple[float, ...]]
    non_finite: int = 0
    pixels: int
    scale: float

    @property
    def max_error(self) -> float:
        return self.parts["all"].max_error

    @property
    def rms_error(self) -> float:
        return self.parts["all"].rms_error

    def as_json(self) -> dict[str, Any]:
        """The measures by name; None for NaN and infinities, which JSON lacks."""
        return without_infinities(asdict(self))


def without_infinities(value: Any) -> Any:
    """Return the value with None for each number that is not finite."""
    if isinstance(value, dict):
        return {key: without_infinities(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [without_infinities(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def measure(
    candidate: Picture,
    reference: Picture,
    limit: float,
    scale: float | None = None,
    *,
    counted: NDArray[np.bool_] | None = None,
) -> Measures:
    """Return the measures of two pictures of one size; `percent_over` counts differences above `limit`.

    With a `scale` the pictures hold numbers, and differences are fractions of the scale. Means and percentages are over
    the `counted` pixels (height, width), by default all; the pictures have to be equal in the other pixels.
    """
    chosen: Any = np.s_[:, :] if counted is None else np.nonzero(counted)
    are_numbers, scale, channels = (
        scale is not None,
        scale or 1.0,
        3 + (candidate.has_opacity and reference.has_opacity),
    )
    if np.array_equal(candidate.pixels, reference.pixels) and np.isfinite(candidate.pixels).all():
        return _of_equal(candidate, channels, limit, scale, candidate.pixels[..., 0][chosen].size)
    ours, theirs = candidate.pixels / np.float32(scale), reference.pixels / np.float32(scale)
    broken = ~(np.isfinite(ours) & np.isfinite(theirs)).all(axis=2)
    rounding = candidate.rounding / scale, reference.rounding / scale
    difference, beyond = _differences(ours, theirs, broken, rounding)
    counted_difference = difference[chosen].reshape(1, -1, 4)
    row, column = divmod(int(difference.max(axis=2).argmax()), difference.shape[1])
    values = _values(candidate, row, column), _values(reference, row, column)
    seen = _filled(ours, broken), _filled(theirs, broken)
    perceived = flip_map(*seen)[chosen]
    seen_flip = float(perceived.mean())
    return Measures(
        parts=_parts(counted_difference, channels),
        beyond_max=float(beyond.max()),
        beyond_rms=_beyond_rms(
            counted_difference[..., :channels],
            *(np.broadcast_to(each, ours.shape)[chosen][..., :channels] for each in rounding),
            is_one_grid=candidate.grid == reference.grid,
        ),
        outlier=float(np.inf if broken.any() else _outlier(*seen, beyond)),
        limit=limit,
        percent_over=100 * float((beyond.max(axis=2)[chosen] > limit).mean()),
        ssim=float(similarity_map(seen[0] @ _WEIGHTS, seen[1] @ _WEIGHTS)[chosen].mean()),
        flip=seen_flip,
        flip_weighted_median=weighted_median(perceived),
        beyond_flip=0.0 if are_numbers else _beyond_flip(seen, beyond, seen_flip, rounding, chosen),
        worst_pixel=(column, row),
        worst_values=values,
        non_finite=int(broken.sum()),
        pixels=counted_difference.shape[1],
        scale=scale,
    )


def _differences(
    ours: NDArray[np.float32], theirs: NDArray[np.float32], broken: NDArray[np.bool_], rounding: tuple[NDArray, NDArray]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the absolute differences, and those beyond rounding; infinite in broken pixels."""
    with np.errstate(invalid="ignore"):
        difference = np.abs(ours.astype(np.float64) - theirs)
        difference[broken] = np.inf
        beyond = np.maximum(difference - rounding[0] - rounding[1] - _SLACK * np.maximum(1, np.abs(theirs)), 0)
    beyond[broken] = np.inf
    return difference, beyond


def _of_equal(picture: Picture, channels: int, limit: float, scale: float, pixels: int) -> Measures:
    """Return the measures of a picture and itself."""
    parts, values = _parts(np.zeros((1, 1, 4)), channels), _values(picture, 0, 0)
    return Measures(parts=parts, limit=limit, worst_values=(values, values), pixels=pixels, scale=scale)


def _values(picture: Picture, row: int, column: int) -> tuple[float, ...]:
    return tuple(map(float, picture.pixels[row, column]))


def _parts(difference: NDArray[np.float64], channels: int) -> dict[str, Channelwise]:
    """Differences of all channels, of colour, and of opacity if there is one."""
    color = _channelwise(difference[..., :3])
    if channels == 3:
        return {"all": color, "color": color}
    return {"all": _channelwise(difference), "color": color, "opacity": _channelwise(difference[..., 3:])}


def _filled(pixels: NDArray[np.float32], broken: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the picture with black pixels where a number is not finite."""
    return np.where(broken[..., np.newaxis], np.float32(0), pixels) if broken.any() else pixels


def _channelwise(difference: NDArray[np.float64]) -> Channelwise:
    rms = float(np.sqrt(np.square(difference).mean()))
    largest = difference.max(axis=2).ravel()
    # Between infinities an interpolated quantile would be NaN.
    percentiles = np.quantile(largest, (0.99, 0.999), method="linear" if np.isfinite(largest).all() else "higher")
    return Channelwise(
        max_error=float(largest.max()),
        rms_error=rms,
        mean_error=float(difference.mean()),
        psnr=float(-20 * np.log10(rms)) if rms > 0 else np.inf,
        percentile_99=float(percentiles[0]),
        percentile_99_9=float(percentiles[1]),
    )


def _beyond_rms(difference: NDArray[np.float64], ours: NDArray, theirs: NDArray, *, is_one_grid: bool) -> float:
    """Return the rms difference beyond rounding.

    Rounding to steps of 2q adds q²/3 on average, and at most q², to the squared difference if only one picture is
    rounded. If both are rounded and differ by δ before, a fraction δ / 2q of the pixels changes by 2q: 2qδ on average;
    so the result is the δ that solves mean d² = δ² + δ mean 2q, with the mean q of the two. Pictures on two grids, such
    as straight and premultiplied colour, round independently: at most q² each.
    """
    if not np.isfinite(difference).all():
        return np.inf
    mean_square = float(np.square(difference).mean())
    one, other = (float(np.square(each).mean()) for each in (ours, theirs))
    if min(one, other) < 0.01 * max(one, other) or max(one, other) == 0:
        return float(np.sqrt(max(mean_square - max(one, other), 0.0)))
    if not is_one_grid:
        return float(np.sqrt(max(mean_square - one - other, 0.0)))
    step = float((ours + theirs).mean())
    return float(np.sqrt(mean_square + step**2 / 4) - step / 2)


def _beyond_flip(
    seen: tuple[NDArray[np.float32], NDArray[np.float32]],
    beyond: NDArray,
    seen_flip: float,
    rounding: tuple[NDArray, NDArray],
    chosen: Any,
) -> float:
    """FLIP of the reference and a candidate whose differences are those beyond rounding; mean of the chosen pixels."""
    if not any(map(np.any, rounding)):
        return seen_flip
    (ours, theirs), beyond = seen, np.where(np.isfinite(beyond), beyond, 0)
    if not beyond.any() or not seen_flip > 0:
        return 0.0
    return float(flip_map((theirs + np.sign(ours - theirs) * beyond).astype(np.float32), theirs)[chosen].mean())


def _outlier(ours: NDArray[np.float32], theirs: NDArray[np.float32], beyond: NDArray[np.float64]) -> float:
    """Largest distance of a pixel from the range of its neighbourhood in the other picture, in either direction.

    An edge that moves by a part of a pixel stays in the range; a wrong pixel in an even area does not.
    """
    outside = [
        np.maximum(extreme_around(np.minimum, other) - one, one - extreme_around(np.maximum, other))
        for one, other in ((ours, theirs), (theirs, ours))
    ]
    return float(np.minimum(np.maximum(np.maximum(*outside), 0), beyond).max())


def extreme_around(extreme: np.ufunc, picture: NDArray) -> NDArray:
    """Return np.minimum or np.maximum of each pixel and its eight neighbours, (height, width, …)."""
    for axis in (0, 1):
        rows = picture.swapaxes(0, axis)
        result = rows.copy()
        extreme(result[1:], rows[:-1], out=result[1:])
        extreme(result[:-1], rows[1:], out=result[:-1])
        picture = result.swapaxes(0, axis)
    return picture


def flip(candidate: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Mean FLIP, 0 to 1, of two displayed pictures: premultiplied colour over black, cut at 1."""
    return float(flip_map(candidate, reference).mean())


def flip_map(candidate: NDArray[np.float32], reference: NDArray[np.float32]) -> NDArray[np.float32]:
    """FLIP of each pixel, (height, width)."""
    import OpenImageIO as oiio

    def buffer(picture: NDArray[np.float32]) -> oiio.ImageBuf:
        return oiio.ImageBuf(np.ascontiguousarray(np.clip(picture[..., :3], 0, 1)))

    found = oiio.ImageBufAlgo.FLIP_diff(buffer(reference), buffer(candidate), hdr=0)
    return np.asarray(found.get_pixels(oiio.FLOAT))[..., 0]


def weighted_median(numbers: NDArray) -> float:
    """Return the number at which half of the sum of all numbers (at least 0) is reached; 0 if all are 0.

    Of a map of FLIP it is the weighted median of its authors. Pixels without a difference have no weight: an object
    that fills a hundredth of a black picture has a median of 0 and a mean near 0, whatever is wrong with the object.
    """
    ordered = np.sort(numbers, axis=None).astype(np.float64)
    sums = np.cumsum(ordered)
    return float(ordered[np.searchsorted(sums, sums[-1] / 2)]) if sums[-1] > 0 else 0.0


def pixel_differences(candidate: NDArray, reference: NDArray) -> NDArray[np.float32]:
    """Return each pixel's largest absolute difference; infinite if either pixel is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        channels = np.moveaxis(np.abs(candidate - reference), 2, 0)
    difference = reduce(np.maximum, channels)  # takes a fifth of the time of max(axis=2)
    return np.where(np.isnan(difference), np.float32(np.inf), difference)


def largest_finite(numbers: NDArray) -> float:
    """Return the largest finite number, or 0."""
    return float(numbers[np.isfinite(numbers)].max(initial=0))


def structural_similarity(candidate: NDArray, reference: NDArray) -> float:
    """Mean SSIM of two pictures (height, width) of range 1."""
    return float(similarity_map(candidate, reference).mean())


def similarity_map(candidate: NDArray, reference: NDArray) -> NDArray[np.float64]:
    """SSIM of each pixel, (height, width)."""
    a, b = candidate.astype(np.float64), reference.astype(np.float64)
    mean_a, mean_b = _smoothed(a), _smoothed(b)
    variance_a = _smoothed(a * a) - mean_a**2
    variance_b = _smoothed(b * b) - mean_b**2
    covariance = _smoothed(a * b) - mean_a * mean_b
    c1, c2 = _SSIM_CONSTANTS
    similarity = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    return np.asarray(similarity / ((mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)))


def _smoothed(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gaussian mean around each pixel, mirrored at the borders."""
    offsets = np.arange(-_REACH, _REACH + 1)
    weights = np.exp(-0.5 * (offsets / _SIGMA) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        padding = [(_REACH, _REACH) if each == axis else (0, 0) for each in (0, 1)]
        padded = np.moveaxis(np.pad(picture, padding, mode="symmetric"), axis, 0)
        count = picture.shape[axis]
        mean = weights[_REACH] * padded[_REACH : _REACH + count]
        for k in range(_REACH):  # both pixels at the same distance
            mean += weights[k] * (padded[k : k + count] + padded[2 * _REACH - k : 2 * _REACH - k + count])
        picture = np.moveaxis(mean, 0, axis)
    return picture
