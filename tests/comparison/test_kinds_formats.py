"""Kinds of difference between pictures of which one or both went through 8 bits: rounding hides none, and is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from support import planted_differences as planted
from support.compared_pictures import eight_bits, held, opaque

from texvol.comparison.kinds import Kind
from texvol.comparison.outcome import examine
from texvol.comparison.pictures import Picture
from texvol.util.color import linear_from_srgb

Kinds = tuple[Kind, ...]


def stored(pixels: np.ndarray, how: str) -> np.ndarray:
    return pixels if how == "float" else eight_bits(pixels)


# Of either number format; never both float, which the other tests are about.
FORMATS = [("8 bits", "float"), ("float", "8 bits"), ("8 bits", "8 bits")]
PLANTS: dict[str, tuple[str, planted.Plant]] = {
    "shifted": ("shifted", planted.moved(0.3, -0.2)),
    "sRGB": ("gamma", planted.on_color(planted.decoded)),
    "power": ("gamma", planted.on_color(lambda c: c**1.5)),
    "thicker": ("scaled opacity", planted.thicker(1.3)),
    "dimmer": ("brightness", planted.on_color(lambda c: 0.9 * c)),
    "a little dimmer": ("brightness", planted.on_color(lambda c: 0.98 * c)),
    "premultiplied twice": ("straight colour", lambda p: np.dstack([p[..., :3] * p[..., 3:], p[..., 3]])),
    "upside down": ("flipped", lambda p: p[::-1].copy()),
    "BGR": ("channels swapped", lambda p: p[..., [2, 1, 0, 3]]),
    "one pixel": ("isolated pixels", planted.one_wrong(-0.2, channel=3)),
}


# Each kind with two of the three pairs of formats.
ROUNDED = [(case, FORMATS[(i + j) % 3]) for i, case in enumerate(PLANTS) for j in (0, 1)]


@pytest.mark.parametrize("case, formats", ROUNDED)
def test_a_planted_difference_is_named_through_8_bits(case: str, formats: tuple[str, str]) -> None:
    name, plant = PLANTS[case]
    reference = planted.cloud()
    kinds = held(stored(plant(reference), formats[0]), stored(reference, formats[1]))
    assert kinds[0].name == name, kinds


@pytest.mark.parametrize("picture", planted.PICTURES)
def test_a_picture_and_its_own_8_bits_differ_by_their_rounding_and_nothing_else(picture: str) -> None:
    reference = planted.PICTURES[picture]()
    for pixels in (reference, opaque(reference)):
        exact = Picture.of_array(pixels)
        bits = Picture.of_array(
            eight_bits(np.dstack([pixels, np.ones(pixels.shape[:2])])[..., :4])[..., : pixels.shape[2]]
        )
        for one, two in ((bits, exact), (exact, bits)):
            (kind,) = examine(one, two).kinds
            assert kind.name == "banding" and "8 bits" in kind.words and "off by" not in kind.words


def test_drivers_that_differ_by_less_than_8_bits_see_differ_by_their_rounding() -> None:
    reference = planted.cloud()
    # A ten-thousandth, as the sums of another driver: some pixels are a step off.
    candidate = reference + 1e-4 * planted.smooth_field(3, (160, 120), 3)[..., None] * reference
    one, two = eight_bits(candidate), eight_bits(reference)
    assert (one != two).any()
    (kind,) = held(one, two)
    assert kind.words == "within the rounding of 8 bits"


@pytest.mark.parametrize("formats", FORMATS, ids=" and ".join)
@pytest.mark.parametrize("dx", [0.1, -0.15])
def test_a_shift_within_the_rounding_of_8_bits_is_found(dx: float, formats: tuple[str, str]) -> None:
    y, x = np.mgrid[:120, :160]

    def waves(by: float) -> np.ndarray:
        light = linear_from_srgb(0.6 + 0.25 * np.sin((x - by) / 9) * np.cos(y / 7 + (x - by) / 23))
        return np.dstack([light, light, light, np.ones_like(light)]).astype(np.float32)

    first = held(stored(waves(dx), formats[0]), stored(waves(0), formats[1]))[0]
    assert first.name == "shifted", first
    # Roundings of half a step, 0.002 of values whose gradient is 0.02 rms, in 19,000 pixels: some thousandths.
    assert first.parameters["dx"] == pytest.approx(dx, abs=0.01)
    assert first.parameters["dy"] == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("formats", FORMATS, ids=" and ".join)
@pytest.mark.parametrize("channel", [0, 3])
def test_one_wrong_pixel_among_roundings_is_the_one_that_is_named(channel: int, formats: tuple[str, str]) -> None:
    reference = planted.detail()
    candidate = planted.one_wrong(-0.1, channel=channel)(reference)
    (kind,) = held(stored(candidate, formats[0]), stored(reference, formats[1]))
    (pixel,) = kind.parameters["pixels"]
    assert kind.name == "isolated pixels" and (pixel["column"], pixel["row"]) == (60, 41)
    assert kind.explained > 0.95


@pytest.mark.parametrize("rms", [0.01, 0.05])
def test_noise_through_8_bits_is_noise(rms: float) -> None:
    reference = opaque(planted.detail())
    kinds = held(
        np.clip(planted.noisy(rms)(reference), 0, 1), np.rint(255 * planted.encoded(reference)).astype(np.uint8)
    )
    assert kinds[0].name == "noise" and kinds[0].parameters["rms"] == pytest.approx(rms, rel=0.05)


def low_bits(numbers: np.ndarray, bits: int) -> np.ndarray:
    return numbers >> (8 - bits) << (8 - bits)


POSTERISED = {
    "first bits": low_bits,
    "repeated bits": lambda numbers, bits: sum(low_bits(numbers, bits) >> shift for shift in range(0, 8, bits)),
    "nearest": lambda numbers, bits: np.rint(np.rint(numbers / 255 * (2**bits - 1)) / (2**bits - 1) * 255),
    "down": lambda numbers, bits: np.rint(np.floor(numbers / 255 * (2**bits - 1)) / (2**bits - 1) * 255),
    "bins": lambda numbers, bits: np.rint(np.floor(numbers / 256 * 2**bits) / (2**bits - 1) * 255),
}


# Each way with each number of bits and each format of the other picture.
FEWER_BITS = [
    (how, bits, ("float", "8 bits")[(i + bits) % 2]) for i, how in enumerate(POSTERISED) for bits in (3, 4, 5, 6)
]


@pytest.mark.parametrize("how, bits, against", FEWER_BITS)
def test_fewer_bits_in_a_file_of_8_are_banding_of_so_many_bits(how: str, bits: int, against: str) -> None:
    reference = opaque(planted.detail())
    numbers = np.rint(255 * planted.encoded(reference)).astype(np.uint8)
    candidate = POSTERISED[how](numbers, bits).astype(np.uint8)
    theirs = numbers if against == "8 bits" else reference
    for one, two, side in ((candidate, theirs, "candidate"), (theirs, candidate, "reference")):
        (kind,) = held(one, two)
        assert (kind.name, kind.parameters["quantised"]) == ("banding", side)
        assert kind.parameters["steps"] == 2**bits - 1 and f"({bits} bits)" in kind.words
        assert kind.explained > 0.98


def test_few_bits_of_linear_light_in_a_file_of_8_are_banding() -> None:
    reference = opaque(planted.detail())
    candidate = np.rint(255 * planted.encoded(np.rint(31 * reference) / 31)).astype(np.uint8)
    (kind,) = held(candidate, reference)
    assert (kind.name, kind.parameters["steps"], kind.parameters["encoding"]) == ("banding", 31, "linear")


def test_half_floats_of_a_picture_of_8_bits_are_half_floats() -> None:
    numbers = np.rint(255 * planted.encoded(opaque(planted.cloud()))) / 255
    reference = planted.decoded(numbers).astype(np.float32)
    (kind,) = held(reference.astype(np.float16), reference)
    assert (kind.name, kind.words) == ("banding", "within the rounding of half floats")


def test_blur_of_8_bits() -> None:
    reference = opaque(planted.detail())
    candidate = ndimage.gaussian_filter(reference, (0.5, 0.5, 0))
    numbers = [np.rint(255 * planted.encoded(each)).astype(np.uint8) for each in (candidate, reference)]
    assert held(*numbers)[0].name == "blurred"


def test_a_difference_that_a_shift_leaves_out_is_no_fault() -> None:
    """A patch on a ramp: where the pictures overlap after a shift there may be no difference at all."""
    ramp = np.linspace(0, 1, 64)[None, :, None] * np.ones((48, 1, 3))
    reference = (255 * ramp).astype(np.uint8)
    candidate = reference.copy()
    candidate[10:20, 10:20] = 255
    outcome = examine(Picture.of_array(candidate, "new"), Picture.of_array(reference, "old"))
    assert outcome.status == "different" and outcome.kinds
