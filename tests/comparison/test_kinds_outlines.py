"""Differences of outlines, and defects that are none; opacity by itself; two kinds of which one is noise."""

from __future__ import annotations

import numpy as np
import pytest
from support import planted_differences as planted
from support.compared_pictures import eight_bits, held, opaque

from texvol.comparison.kinds import kinds_of


def disk(*, smooth: bool) -> np.ndarray:
    y, x = np.mgrid[:128, :128]
    from_rim = 40 - np.hypot(x - 63.3, y - 60.7)
    return np.repeat((np.clip(0.5 + from_rim, 0, 1) if smooth else 1.0 * (from_rim > 0))[..., None], 3, 2)


def plot(*, smooth: bool) -> np.ndarray:
    """A dark curve, and bars of black and blue, on white."""
    y, x = np.mgrid[:150, :220]
    off = np.abs(y - 70 - 40 * np.sin(x / 25)) / np.sqrt(1 + np.square(1.6 * np.cos(x / 25)))
    line = np.clip(1.3 - off, 0, 1) if smooth else 1.0 * (off < 0.8)
    shown = 1 - line[..., None] * np.array([0.9, 0.6, 0.3])
    shown[130:140, 20:200:20] = 0
    shown[20:60, 160:200] = (0.3, 0.5, 0.9)
    return np.asarray(shown, np.float32)


@pytest.mark.parametrize("picture", [disk, plot])
def test_an_outline_with_and_without_smoothing_is_a_difference_of_edges(picture) -> None:  # type: ignore[no-untyped-def]
    smooth, hard = picture(smooth=True), picture(smooth=False)
    for one, two in ((smooth, hard), (hard, smooth)):
        assert held(one, two)[0].name == "edges only"
    stored = [np.rint(255 * planted.encoded(each)).astype(np.uint8) for each in (hard, smooth)]
    assert held(*stored)[0].name == "edges only"


@pytest.mark.parametrize("picture", planted.PICTURES)
def test_a_spot_makes_edges_of_its_own_and_is_no_difference_of_edges(picture: str) -> None:
    reference = opaque(planted.PICTURES[picture]())
    candidate = reference.copy()
    candidate[60:64, 70:74] *= 0.5
    for one, two in ((candidate, reference), (reference, candidate)):
        assert "edges only" not in {kind.name for kind in held(one, two)}


@pytest.mark.parametrize("picture", planted.PICTURES)
def test_white_pixels_here_and_there_are_noise(picture: str) -> None:
    reference = np.rint(255 * planted.encoded(opaque(planted.PICTURES[picture]()))).astype(np.uint8)
    candidate = reference.copy()
    chosen = np.random.default_rng(5).random(reference.shape[:2]) < 0.004
    candidate[chosen] = 255
    first = held(candidate, reference)[0]
    assert first.name == "noise"
    assert "of mean zero" not in first.words and first.parameters["share"] == pytest.approx(chosen.mean(), rel=0.01)


@pytest.mark.parametrize("factor", [0.9, 0.7, 1.0 / 0.9])
def test_opacity_times_a_factor_by_itself(factor: float) -> None:
    reference = planted.cloud() * np.float32([1, 1, 1, 0.85])
    first = kinds_of(reference * np.float32([1, 1, 1, factor]), reference)[0]
    assert (first.name, first.parameters["part"]) == ("scaled opacity", "opacity")
    assert first.parameters["factor"] == pytest.approx(factor, rel=1e-4) and "colour is the same" in first.words


@pytest.mark.parametrize("factor", [1.1, 1.3])
def test_opacity_times_a_factor_under_the_same_straight_colour_ends_at_1(factor: float) -> None:
    reference = planted.cloud()
    opacity = np.minimum(factor * reference[..., 3], 1)
    candidate = planted.picture_of(planted.straight(reference), opacity)
    assert (opacity == 1).sum() > 100, "some is cut"
    for one, two, by in ((candidate, reference, factor), (reference, candidate, 1 / factor)):
        first = kinds_of(one, two)[0]
        assert first.name == "scaled opacity" and first.parameters["factor"] == pytest.approx(by, rel=1e-3)


@pytest.mark.parametrize("stored", [False, True])
def test_gamma_for_srgb(stored: bool) -> None:
    reference = opaque(planted.detail())
    one, two = reference ** (1 / 2.2), planted.encoded(reference)
    if stored:
        one, two = np.rint(255 * one).astype(np.uint8), np.rint(255 * two).astype(np.uint8)
    else:
        one, two = planted.decoded(one).astype(np.float32), reference
    assert {held(one, two)[0].parameters["encoded"], held(two, one)[0].parameters["encoded"]} == {
        "candidate",
        "reference",
    }
    assert "gamma 2.2" in held(one, two)[0].words and held(one, two)[0].name == "gamma"


def test_swapped_order_through_8_bits() -> None:
    one, two = planted.swapped(planted.cloud())
    for pair in ((eight_bits(one), two), (one, eight_bits(two)), (eight_bits(one), eight_bits(two))):
        assert held(*pair)[0].name == "swapped order"


def test_many_steps_off_are_no_explanation() -> None:
    reference = opaque(planted.cloud())
    candidate = reference * (1 + 0.05 * planted.smooth_field(5, (160, 120), 3)[..., None])
    numbers = [np.rint(255 * planted.encoded(each)).astype(np.uint8) for each in (candidate, reference)]
    assert np.abs(numbers[0].astype(int) - numbers[1]).max() > 3
    assert not any("off by" in kind.words for kind in held(*numbers))


def dimmed(by: float) -> planted.Plant:
    return planted.on_color(lambda c: by * c)


@pytest.mark.parametrize("picture", planted.PICTURES)
@pytest.mark.parametrize(
    "first, second, names",
    [
        (dimmed(1.01), planted.moved(1, 0), {"brightness", "shifted"}),
        (dimmed(1.01), planted.noisy(0.01), {"brightness", "noise"}),
        (planted.moved(1, 0), planted.noisy(0.01), {"shifted", "noise"}),
    ],
    ids=["brightness and shift", "brightness and noise", "shift and noise"],
)
def test_a_small_one_beside_a_large_one_is_named(
    first: planted.Plant, second: planted.Plant, names: set[str], picture: str
) -> None:
    reference = planted.PICTURES[picture]()
    candidate = second(first(reference))
    for one, two in ((candidate, reference), (reference, candidate)):
        assert {kind.name for kind in kinds_of(one, two)} == names


@pytest.mark.parametrize("rms", [0.003, 0.1])
@pytest.mark.parametrize("picture", planted.PICTURES)
def test_noise_alone_is_neither_dimmer_nor_shifted(picture: str, rms: float) -> None:
    reference = planted.PICTURES[picture]()
    noisy = planted.noisy(rms)(reference)
    for one, two in ((noisy, reference), (reference, noisy)):
        assert {kind.name for kind in kinds_of(one, two)} == {"noise"}


def test_words_are_whole_sentences() -> None:
    reference = planted.cloud()
    said = [
        kind.words
        for plant in (planted.speckled, planted.noisy(0.01))
        for kind in kinds_of(plant(reference), reference)
    ]
    # Opacity alone in 8 bits; noise that goes with brightness; a shift by hardly anything to the left.
    opacity = np.dstack([reference[..., :3], np.rint(255 * reference[..., 3]) / 255]).astype(np.float32)
    (banding,) = kinds_of(opacity, reference)
    assert "is quantised to 255 steps of opacity" in banding.words
    uneven = reference * (1 + 0.2 * np.random.default_rng(1).standard_normal(reference.shape).astype(np.float32))
    said += [kind.words for kind in kinds_of(uneven.astype(np.float32), reference)]
    (shift,) = kinds_of(planted.moved(-0.004, 0.1)(reference), reference)
    assert "(+0.00, +0.10) pixels, down" in shift.words
    assert not any("others everywhere" in each for each in said) and any("more in some places" in each for each in said)
