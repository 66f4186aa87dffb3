"""Limits: what they allow, where they come from, and what is no limit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_measures import smooth

from texvol.comparison.limits import (
    NAMES,
    NONE,
    ONE_DRIVER,
    TWO_DRIVERS,
    Limits,
    default_limits,
    given_limits,
    named_limits,
    violations,
)
from texvol.comparison.measures import Measures, measure
from texvol.comparison.pictures import Picture
from texvol.util.errors import InputError


def measured(change: float = 0.0, limit: float = 1e-3) -> Measures:
    reference = smooth()
    return measure(Picture.of_array(reference + np.float32(change)), Picture.of_array(reference), limit)


def test_nothing_breaks_no_limit_not_even_zero() -> None:
    zero = Limits(0, 0, 0, 0, 0, 0)
    assert violations(measured(), zero) == ()


@pytest.mark.parametrize("name", NAMES)
def test_each_limit_is_broken_by_itself_and_says_its_name(name: str) -> None:
    alone = replace(NONE, **{name: 1e-4})
    if name == "fail_percent":
        alone = replace(NONE, max_abs=0.01, fail_percent=99.0)
        assert violations(measured(0.1, limit=0.01), replace(alone, fail_percent=100.0)) == ()
    found = measured(0.1, alone.max_abs)
    if name == "outlier":
        # An even ground that is brighter everywhere is outside of any neighbourhood.
        found = measure(Picture.of_array(np.full((9, 9), 0.6)), Picture.of_array(np.full((9, 9), 0.5)), np.inf)
    broken = violations(found, alone)
    assert len(broken) == 1 and name.replace("_", "-") in broken[0]


def test_what_is_no_number_breaks_every_limit_but_none() -> None:
    reference = smooth()
    candidate = reference.copy()
    candidate[3, 4] = np.nan
    found = measure(Picture.of_array(candidate), Picture.of_array(reference), 0.5)
    assert len(violations(found, replace(TWO_DRIVERS, fail_percent=0.0, hard_max=1.0))) >= 4


@pytest.mark.parametrize("name", ["percent_over", "beyond_max", "outlier", "beyond_rms", "beyond_flip"])
def test_a_measure_that_is_no_number_breaks_its_limit(name: str) -> None:
    assert not violations(measured(), ONE_DRIVER)
    assert len(violations(replace(measured(), **{name: np.nan}), ONE_DRIVER)) == 1


def test_two_drivers_are_told_by_the_header() -> None:
    def drawn_by(name: str | None) -> Picture:
        return Picture.of_array(smooth(), attributes={} if name is None else {"texvol:renderer": name})

    assert default_limits(drawn_by("a"), drawn_by("b")) is TWO_DRIVERS
    for pair in (("a", "a"), ("a", None), (None, "b"), (None, None)):
        assert default_limits(drawn_by(pair[0]), drawn_by(pair[1])) is ONE_DRIVER


def test_limits_that_are_given_are_the_only_ones_or_replace_those_of_a_base() -> None:
    assert given_limits({}) is None
    alone = given_limits({"rms": 0.01})
    assert alone is not None and alone.rms == 0.01 and alone.max_abs == alone.hard_max == alone.flip == np.inf
    fraction = given_limits({"fail-percent": 2.0})
    assert fraction is not None and fraction.max_abs == ONE_DRIVER.max_abs and fraction.fail_percent == 2
    based = given_limits({"rms": 0.01}, TWO_DRIVERS)
    assert based is not None and based.rms == 0.01 and based.flip == TWO_DRIVERS.flip
    assert given_limits({}, TWO_DRIVERS) is TWO_DRIVERS


def test_looser_ones_are_named() -> None:
    assert TWO_DRIVERS.looser_than(ONE_DRIVER) == ("max-abs", "fail-percent", "rms", "flip")
    assert ONE_DRIVER.looser_than(ONE_DRIVER) == ()


def test_a_file_of_limits_replaces_those_of_its_base(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text('base = "two-drivers"\nrms = 0.01\n')
    assert named_limits(str(path)) == replace(TWO_DRIVERS, rms=0.01, source=str(path))
    path.write_text("flip = 0.1\n")
    assert named_limits(str(path)) == replace(ONE_DRIVER, flip=0.1, source=str(path))
    assert named_limits("two-drivers") is TWO_DRIVERS


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("rms = -1", "at least 0"),
        ("rms = nan", "at least 0"),
        ('rms = "small"', "'small'"),
        ("rms = true", "True"),
        ("fail-percent = 101", "at most 100"),
        ("psnr = 3", "limit 'psnr' not found"),
        ('base = "nothing"', "'nothing'"),
        ("rms =", "is not TOML"),
        ("base = [1]", "base must be one of"),
        ("[orbital]\nrms = 1", "limit 'orbital' not found"),
    ],
)
def test_wrong_files_are_refused_by_name(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(content)
    with pytest.raises(InputError) as caught:
        named_limits(str(path))
    assert words in str(caught.value) and "limits.toml" in str(caught.value)


def test_no_file_and_no_name_is_refused() -> None:
    with pytest.raises(InputError, match="must be a TOML file or one of one-driver, two-drivers"):
        named_limits("three-drivers")
    with pytest.raises(InputError, match="No such file"):
        named_limits("gone.toml")
