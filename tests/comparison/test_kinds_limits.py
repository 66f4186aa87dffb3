"""What needs no hypothesis, and what is too small, too large or too even for one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import planted_differences as planted

from texvol.comparison import compare
from texvol.comparison.kinds import NAMES, kinds_of
from texvol.util.errors import InputError


def test_the_same_pictures_differ_in_no_kind() -> None:
    for picture in (planted.cloud(), np.zeros((1, 1, 4)), np.full((3, 2, 4), np.float32(1e30))):
        assert kinds_of(picture, picture.copy()) == ()


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_rounding_of_sums_is_rounding(scale: float) -> None:
    reference = planted.cloud() * np.float32(scale)
    by = np.random.default_rng(0).uniform(-5e-7, 5e-7, reference.shape) * reference.max()
    (kind,) = kinds_of((reference + by).astype(np.float32), reference)
    assert kind.name == "rounding"
    # Twenty times as much is noise.
    (kind,) = kinds_of((reference + 20 * by).astype(np.float32), reference)
    assert kind.name == "noise"


def test_what_is_not_finite_is_counted_and_the_rest_is_looked_at() -> None:
    reference = planted.cloud()
    candidate = planted.on_color(planted.encoded)(reference)
    candidate[30, 7, 2], candidate[99, 120], reference[50, 3, 3] = np.nan, np.inf, -np.inf
    first, second = kinds_of(candidate, reference)
    assert first.name == "not finite" and first.parameters["first"] == [7, 30]
    assert (first.parameters["pixels"], first.parameters["candidate"], first.parameters["reference"]) == (3, 2, 1)
    assert "column 7, row 30" in first.words and "NaN and infinity" in first.words
    assert second.name == "gamma" and second.explained > 0.999
    assert np.isnan(candidate[30, 7, 2]), "pictures that came stay as they are"


def test_a_pixel_that_is_not_finite_hides_no_shift_of_pictures_without_opacity() -> None:
    reference = planted.cloud()
    candidate = planted.moved(1, 2)(reference)
    candidate[5, 6] = np.nan
    found = kinds_of(candidate, reference, has_opacity=False)
    assert [each.name for each in found[:2]] == ["not finite", "shifted"]


def test_a_picture_of_nothing_but_nan() -> None:
    (kind,) = kinds_of(np.full((4, 5, 4), np.nan), np.zeros((4, 5, 4)))
    assert kind.name == "not finite" and kind.parameters["pixels"] == 20


@pytest.mark.parametrize("steps, bits", [(255, "8 bits"), (1023, "10 bits")])
def test_within_the_allowance_it_is_rounding_of_bits_and_nothing_grander(steps: int, bits: str) -> None:
    reference = planted.cloud()
    candidate = planted.quantised(steps)(reference)
    (kind,) = kinds_of(candidate, reference, roundings=(0.5 / steps, 0))
    assert (kind.name, kind.words) == ("banding", f"within the rounding of {bits}")


def test_within_the_allowance_even_a_shift_is_none() -> None:
    reference = planted.cloud()
    candidate = planted.moved(0.01, 0)(reference)
    assert kinds_of(candidate, reference)[0].name == "shifted"
    (kind,) = kinds_of(candidate, reference, roundings=(np.abs(candidate - reference).max(), 0))
    assert kind.name == "rounding"


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 7), (3, 2), (4, 4), (7, 40)])
@pytest.mark.parametrize("seed", range(2))
def test_tiny_pictures_have_kinds_and_no_warnings(size: tuple[int, int], seed: int) -> None:
    random = np.random.default_rng(seed)
    one, two = (random.random((size[1], size[0], 4)).astype(np.float32) for _ in range(2))
    one, two = (np.dstack([p[..., :3] * p[..., 3:], p[..., 3]]) for p in (one, two))
    with np.errstate(all="raise", under="ignore"):
        kinds = kinds_of(one, two)
    assert 1 <= len(kinds) <= 3
    # Random pixels of other random pixels: only a picture of hardly a number can look like anything.
    assert kinds[0].name in ("unexplained", "isolated pixels", "noise") or size[0] * size[1] < 8


def test_one_of_six_pixels() -> None:
    reference = np.random.default_rng(0).random((2, 3, 4)).astype(np.float32)
    candidate = reference.copy()
    candidate[1, 2, 0] -= 0.25
    (kind,) = kinds_of(candidate, reference)
    (pixel,) = kind.parameters["pixels"]
    assert kind.name == "isolated pixels" and (pixel["column"], pixel["row"], pixel["channel"]) == (2, 1, "red")
    assert pixel["by"] == pytest.approx(-0.25)
    assert "column 2, row 1: red -0.25" in kind.words


@pytest.mark.parametrize("factor", [1.5, 3.0])
@pytest.mark.parametrize("scale", [1e-3, 1e3, 1e25])
def test_light_of_any_brightness(scale: float, factor: float) -> None:
    reference = planted.cloud() * np.float32([scale, scale, scale, 1])
    (kind,) = kinds_of(reference * np.float32([factor, factor, factor, 1]), reference)
    assert kind.name == "brightness" and kind.parameters["factor"] == pytest.approx(factor, rel=1e-4)


def test_black_and_even_pictures() -> None:
    black, grey = np.zeros((9, 8, 4), np.float32), np.full((9, 8, 4), np.float32(0.5))
    for one, two in ((black, grey), (grey, black), (grey, 0.4 * grey)):
        for has_opacity in (True, False):
            assert kinds_of(one, two, has_opacity=has_opacity)[0].name in ("brightness", "background", "unexplained")


def test_every_kind_can_be_written_as_json() -> None:
    reference = planted.cloud()
    plants = (planted.moved(0.3, 0), planted.noisy(0.1), planted.quantised(255), planted.speckled, planted.thicker(2))
    for plant in (*plants, planted.one_wrong(0.2), planted.one_wrong(np.nan), planted.before_light((1, 0, 0))):
        for kind in kinds_of(plant(reference), reference):
            json.dumps(dict(kind.parameters), allow_nan=False)
            assert kind.name in NAMES and 0 <= kind.explained <= 1 and kind.words


def test_what_is_no_pair_of_pictures_is_refused() -> None:
    picture = planted.cloud()
    for one, two in ((picture, picture[:-1]), (picture[..., :3], picture[..., :3]), (picture[:0], picture[:0])):
        with pytest.raises(InputError, match="must have one shape"):
            kinds_of(one, two)


@pytest.mark.parametrize("name", ["a.png", Path("a.png")])
def test_a_name_in_place_of_a_picture_is_told_the_command_that_takes_names(name: Any) -> None:
    with pytest.raises(
        InputError, match="^reference must be an array of numbers, got 'a.png': texvol diff compares files$"
    ):
        compare(planted.cloud(), name)
    with pytest.raises(InputError, match="^candidate must be an array of numbers, got list$"):
        compare([[[1.0], [1.0, 2.0]]], planted.cloud())
