"""Pixels in a page's data: true to four digits, differences too, and small."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray
from support.compared_pictures import blob

from texvol.comparison.pixel_data import MANTISSA_BITS, candidate_data, reference_data

DROPPED = 23 - MANTISSA_BITS
# Half a step of the mantissa that is kept; what follows for sums and differences is derived in pixel_data.py. Numbers
# below the smallest normal one have fewer digits, of which a step is kept.
ROUNDOFF, LEAST = 2.0**-15, 2.0 ** (-149 + DROPPED)


def unpacked(data: dict[str, Any]) -> NDArray[np.uint32]:
    """What the page's script does first: bytes of one weight after the other, channels after each other."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["bytes"])), np.uint8).reshape(3, -1).astype(np.uint32)
    numbers = planes[0] | planes[1] << 8 | planes[2] << 16
    return np.moveaxis(numbers.reshape(-1, data["height"], data["width"])[data["channels"]], 0, 2)


def as_floats(numbers: NDArray[np.uint32]) -> NDArray[np.float32]:
    return ((numbers >> 1 & 0x3FFFFF) << DROPPED | (numbers & 1) << 31).astype(np.uint32).view(np.float32)


def reference_of(data: dict[str, Any]) -> NDArray[np.float32]:
    steps = unpacked(data).astype(np.int64)
    return as_floats(np.cumsum(steps >> 1 ^ -(steps & 1), axis=1).astype(np.uint32))


def pair_of(data: dict[str, Any], reference: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    numbers = unpacked(data)
    kept, base = as_floats(numbers).astype(np.float64), reference.astype(np.float64)
    is_whole = (numbers >> 23).astype(bool)
    with np.errstate(invalid="ignore"):
        return np.where(is_whole, kept, base + kept), np.where(is_whole, kept - base, kept)


def close(told: NDArray, true: NDArray, tolerance: float) -> None:
    """Within a share of itself, and not a number where it is none."""
    finite = np.isfinite(true)
    assert (told[~finite] == true[~finite])[~np.isnan(true[~finite])].all()
    assert np.isnan(told[np.isnan(true)]).all()
    assert (np.abs(told[finite] - true[finite]) <= tolerance * np.abs(true[finite]) + 8 * LEAST).all()


def check(candidate: NDArray[np.float32], reference: NDArray[np.float32]) -> None:
    told_reference = reference_of(reference_data(reference))
    close(told_reference.astype(np.float64), reference.astype(np.float64), ROUNDOFF)
    data = candidate_data(candidate, reference)
    if data is None:
        assert np.array_equal(candidate, reference)
        return
    told_candidate, told_difference = pair_of(data, told_reference)
    with np.errstate(invalid="ignore"):
        difference = candidate.astype(np.float64) - reference
    close(told_candidate, candidate.astype(np.float64), 2 * ROUNDOFF)
    close(told_difference, difference, 5 * ROUNDOFF)


def test_a_small_difference_keeps_its_digits() -> None:
    reference = np.full((4, 5, 4), 0.7, np.float32)
    candidate = np.nextafter(reference, np.float32(1))
    data = candidate_data(candidate, reference)
    assert data is not None
    _, difference = pair_of(data, reference_of(reference_data(reference)))
    assert difference == pytest.approx(2.0**-24, rel=ROUNDOFF)


def test_what_is_no_number_stays_what_it_is() -> None:
    odd = np.float32([np.nan, np.inf, -np.inf, 0, -0.0, 1, -3e38, 1e-30])
    reference, candidate = np.meshgrid(odd, odd)
    check(*(np.stack([each] * 4, axis=2) for each in (candidate, reference)))


# The last numbers before infinity would round up to it.
numbers = st.floats(-(2.0**126), 2.0**126, width=32, allow_subnormal=False) | st.sampled_from(
    [0.0, 1.0, 0.5, float("nan"), float("inf")]
)
pictures = arrays.arrays(np.float32, (2, 3, 4), elements=numbers)


@settings(deadline=None)
@given(pictures, pictures)
def test_all_three_are_true_to_four_digits(candidate: NDArray[np.float32], reference: NDArray[np.float32]) -> None:
    check(candidate, reference)


@settings(deadline=None)
@given(pictures, st.floats(-1, 1))
def test_they_are_where_the_pictures_are_near_each_other(reference: NDArray[np.float32], fraction: float) -> None:
    check((reference * np.float32(1 + fraction)).astype(np.float32), reference)


def test_they_are_however_far_the_pictures_are_apart() -> None:
    rng = np.random.default_rng(3)
    candidate = rng.uniform(0.5, 1, (60, 60, 4)).astype(np.float32)
    check(candidate, (candidate * np.linspace(-4, 4, 60, dtype=np.float32)[:, np.newaxis, np.newaxis]))


def test_equal_pictures_are_kept_once() -> None:
    picture = blob(40, 30)
    assert candidate_data(picture, picture.copy()) is None


def test_a_smooth_pair_is_small() -> None:
    candidate, reference = blob(512, 512, 0.1), blob(512, 512)
    size = sum(len(each["bytes"]) for each in (reference_data(reference), candidate_data(candidate, reference) or {}))
    assert size < 1.5e6, "half of what a page may have; float32 alone would be 11 million characters"
