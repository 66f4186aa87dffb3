"""Limits of the difference of two pictures, and the origin of their defaults.

One machine draws the same picture twice, bit for bit (measured: Mesa's llvmpipe, EGL and OSMesa, vectors of 128 and
256 bits, all pictures of the gallery). Another processor or compiler rounds differently: 2^-24 of a number, in some
hundreds of sums along a ray, is at most 1e-4 of light; `ONE_DRIVER` allows ten times that in each pixel.

Two drivers also place samples differently: graphics cards interpolate textures with weights of 8 bits, so that a
sample is up to 1/512 of a voxel off. In smooth parts of a picture that is less than a level of 8 bits. Where a ray
just hits or just misses a surface a pixel may change completely: with 8-bit weights planted in the shaders, and the
twelve pictures of the gallery at 128 and 400 pixels, up to 0.12% of the pixels changed by more than 1/255, by up to 1;
rms was at most 2.9e-3, FLIP 0.0012, and no pixel left the range of its neighbours by more than 0.34. `TWO_DRIVERS`
allows one and a half to four times that. `TWO_DRIVERS` misses a wrong pixel on an edge; `ONE_DRIVER` finds it.

FLIP of two pictures that differ everywhere by the rms limit is up to 0.008 and 0.08 on dark grey (0.05 of light), and
more than twice that on black, which no scene fills: the limits of FLIP are 0.01 and 0.05.

The default is `TWO_DRIVERS` if both pictures name their driver, and the drivers differ; otherwise `ONE_DRIVER`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from texvol.comparison.measures import Measures, without_infinities
from texvol.comparison.pictures import Picture
from texvol.util import text_files
from texvol.util.errors import InputError

DRIVER_ATTRIBUTE = "texvol:renderer"


@dataclass(frozen=True)
class Limits:
    """Limits of a pair's measures, in linear premultiplied light, beyond the rounding of number formats.

    Attributes
    ----------
    max_abs : float
        A pixel differs if any channel differs by more; up to `fail_percent` of the pixels may differ.
    fail_percent : float
        0 to 100.
    hard_max : float
        Largest difference of any channel of any pixel.
    outlier : float
        Largest distance of a pixel from the range of the pixel and its eight neighbours in the other picture.
    rms, flip : float
        Over the whole picture.
    source : str
        Origin of the limits, in words.
    """

    max_abs: float
    fail_percent: float
    hard_max: float
    outlier: float
    rms: float
    flip: float
    source: str = "given"

    def __post_init__(self) -> None:
        for name in NAMES:
            number = getattr(self, name)
            if isinstance(number, bool) or not isinstance(number, int | float) or not number >= 0:
                raise InputError(f"{_key(name)} must be a number of at least 0, got {number!r}")
        if self.fail_percent > 100:
            raise InputError(f"fail-percent must be at most 100, got {self.fail_percent:g}")

    def looser_than(self, other: Limits) -> tuple[str, ...]:
        """Names, as on the command line, of the limits that are larger than the other's."""
        return tuple(_key(name) for name in NAMES if getattr(self, name) > getattr(other, name))

    def as_json(self) -> dict[str, Any]:
        """The limits by their names on the command line; None for no limit."""
        return {_key(name): without_infinities(value) for name, value in asdict(self).items()}


NAMES = tuple(each.name for each in fields(Limits) if each.name != "source")
ONE_DRIVER = Limits(1e-3, 0.0, np.inf, np.inf, 2e-4, 0.01, "one driver")
TWO_DRIVERS = Limits(1 / 255, 0.5, np.inf, 0.45, 6e-3, 0.05, "two drivers")
NONE = Limits(np.inf, 0.0, np.inf, np.inf, np.inf, np.inf, "none")
NAMED = {"one-driver": ONE_DRIVER, "two-drivers": TWO_DRIVERS}


def default_limits(candidate: Picture, reference: Picture) -> Limits:
    """Return the default limits of a pair, see the module."""
    drivers = [each.attributes.get(DRIVER_ATTRIBUTE) for each in (candidate, reference)]
    return TWO_DRIVERS if all(drivers) and drivers[0] != drivers[1] else ONE_DRIVER


def changed_limits(limits: Limits, given: Mapping[str, Any], source: str) -> Limits:
    """Return the limits with those of `given`, by the command line's names, replaced.

    Raises
    ------
    InputError
        If a name or a number is not valid.
    """
    for key in given:
        if key not in map(_key, NAMES):
            raise InputError(f"limit {key!r} not found; the limits are {', '.join(map(_key, NAMES))}")
    return replace(limits, **{key.replace("-", "_"): value for key, value in given.items()}, source=source)


def given_limits(given: Mapping[str, Any], base: Limits | None = None) -> Limits | None:
    """Return the limits that a user gives: those alone, or with a `base` those of the base replaced.

    None if nothing is given. `fail-percent` alone counts pixels with the `max-abs` of `ONE_DRIVER`.
    """
    if base is not None or not given:
        return changed_limits(base, given, f"{base.source}, and given") if base and given else base
    without = replace(NONE, max_abs=ONE_DRIVER.max_abs) if set(given) == {"fail-percent"} else NONE
    return changed_limits(without, given, "given")


def named_limits(name: str) -> Limits:
    """Return the limits of a name, or of a TOML file: keys as on the command line, and `base`, a name.

    Limits that the file leaves out are those of its base, by default `one-driver`.

    Raises
    ------
    InputError
        If `name` is neither, or the file's content is not valid.
    """
    if name in NAMED:
        return NAMED[name]
    if not name.lower().endswith(".toml") and not os.path.exists(name):
        raise InputError(f"--limits must be a TOML file or one of {', '.join(NAMED)}, got {name!r}")
    content = text_files.read_toml(name)
    base = content.pop("base", "one-driver")
    if not isinstance(base, str) or base not in NAMED:
        raise InputError(f"{name}: base must be one of {', '.join(NAMED)}, got {base!r}")
    try:
        return changed_limits(NAMED[base], content, name)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


@dataclass(frozen=True)
class Check:
    """A measure beside its limit, and a sentence for a broken limit; `key` is the limit's name on the command line."""

    key: str
    measure: float
    limit: float
    words: str

    @property
    def is_broken(self) -> bool:
        """True if the measure exceeds the limit, or is NaN."""
        return not self.measure <= self.limit


# Limit: measure, and words before its number.
_LIMITED = {
    "hard_max": ("beyond_max", "a pixel differs by"),
    "outlier": ("outlier", "a pixel is outside the range of its neighbours by"),
    "rms": ("beyond_rms", "the rms difference is"),
    "flip": ("beyond_flip", "FLIP is"),
}


def checks(measures: Measures, limits: Limits) -> list[Check]:
    """Return each measure that has a limit beside that limit."""
    percent, allowed = measures.percent_over, limits.fail_percent
    words = f"{percent:.3g}% of the pixels differ by more than {measures.limit:.3g}"
    found = [Check("max-abs", percent, allowed, f"{words}, the limit is {allowed:g}% (max-abs, fail-percent)")]
    for name, (measured, words) in _LIMITED.items():
        measure, limit, key = getattr(measures, measured), getattr(limits, name), _key(name)
        found.append(Check(key, measure, limit, f"{words} {measure:.3g}, the limit is {limit:.3g} ({key})"))
    return found


def violations(measures: Measures, limits: Limits) -> tuple[str, ...]:
    """Return a sentence for each broken limit."""
    return tuple(each.words for each in checks(measures, limits) if each.is_broken)


def _key(name: str) -> str:
    return name.replace("_", "-")
