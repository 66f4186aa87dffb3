"""Converters of plain option values; each raises argparse.ArgumentTypeError that says what the value must be."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable

import numpy as np

from texvol.scene.air import HOUNSFIELD, Air, checked_air

ALL = "all"  # time steps, or pixels


def size(text: str) -> tuple[int, int]:
    """Return (width, height) of "WIDTHxHEIGHT"."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×,]\s*(\d{1,9})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, such as 640x480, got {text!r}")
    return int(match[1]), int(match[2])


def triple(text: str) -> tuple[float, float, float]:
    """Return the three numbers of "X,Y,Z"."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"must be three numbers X,Y,Z, got {text!r}")
    return numbers


def color(text: str) -> tuple[float, float, float] | None:
    """Return linear RGB of "R,G,B", or None for "transparent"."""
    if text.strip().lower() in ("transparent", "none"):
        return None
    numbers = triple(text)
    if not all(0 <= number < np.inf for number in numbers):
        raise argparse.ArgumentTypeError(f"must be three numbers of at least 0, R,G,B, got {text!r}")
    return numbers


def dimensions(text: str) -> tuple[int, int, int]:
    """Return (nx, ny, nz) of "NX,NY,NZ"."""
    match = re.fullmatch(r"\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"must be NX,NY,NZ, such as 256,256,128, got {text!r}")
    return int(match[1]), int(match[2]), int(match[3])


def number(text: str) -> float:
    """Return a number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}") from None


def air(text: str) -> Air:
    """Return the value of air: a number, "hounsfield", or None for "none"."""
    word = text.strip().lower()
    if word in ("none", HOUNSFIELD):
        return None if word == "none" else HOUNSFIELD
    try:
        return checked_air(float(text))
    except ValueError:  # InputError is one
        raise argparse.ArgumentTypeError(f"must be a finite number, {HOUNSFIELD} or none, got {text!r}") from None


def sample_value(text: str) -> int | float:
    """Return a sample value: an integer with all its digits, or a float."""
    if re.fullmatch(r"\s*[+-]?\d{1,40}\s*", text):
        return int(text)
    value = number(text)
    if np.isnan(value):
        raise argparse.ArgumentTypeError("must be a number, got NaN: samples that are NaN are missing anyway")
    return value


def sample_values(value: object) -> list[int | float]:
    """Return sample values from a scene file's number or array of numbers."""
    several = value if isinstance(value, list) else [value]
    if any(isinstance(each, bool) or not isinstance(each, int | float | str) for each in several):
        raise argparse.ArgumentTypeError(f"must be a number or an array of numbers, got {value!r}")
    return [sample_value(each if isinstance(each, str) else repr(each)) for each in several]


def megabytes(text: str) -> float:
    """Return megabytes of texture memory."""
    value = number(text)
    if not 0 < value < 1e12:  # an exabyte: more than any device has, and still exact in bytes
        raise argparse.ArgumentTypeError(f"must be a number of megabytes over 0 and under 1e12, got {text!r}")
    return value


def transmittance(text: str) -> float:
    """Return a transmittance, at least 0 and under 1."""
    value = number(text)
    if not 0 <= value < 1:
        raise argparse.ArgumentTypeError(f"must be a transmittance of at least 0 and under 1, got {text!r}")
    return value


def views(text: str) -> int:
    """Return the number of views of an orbit."""
    return _count(text, "views")


def frames(text: str) -> int:
    """Return the number of frames that a window shows."""
    return _count(text, "frames")


def _count(text: str, what: str) -> int:
    if not re.fullmatch(r"\s*\+?\d{1,9}\s*", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a number of {what}, at least 1, got {text!r}")
    return int(text)


def pixels(text: str) -> int | str:
    """Return a number of pixels, at least 1, or "all"."""
    return ALL if text.strip().lower() == ALL else _count(text, "pixels")


def frames_per_second(text: str) -> float:
    """Return frames per second of a film."""
    value = number(text)
    if not 0.1 <= value <= 1000:
        raise argparse.ArgumentTypeError(f"must be frames per second from 0.1 to 1000, got {text!r}")
    return value


def index(text: str) -> int:
    """Return a whole number of at least 0."""
    if not re.fullmatch(r"\s*\+?\d{1,18}\s*", text):
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 0, got {text!r}")
    return int(text)


def time_step(text: str) -> int | str:
    """Return a time step, at least 0, or "all"."""
    return ALL if text.strip().lower() == ALL else index(text)


def file_name(text: str) -> str:
    """Return the name of an output file; an empty name, as of an unset shell variable, is an error."""
    if not text:
        raise argparse.ArgumentTypeError("must be the name of a file, got ''")
    return text


def choice(*allowed: str) -> Callable[[str], str]:
    """Return a converter that accepts only these words."""

    def choose(text: str) -> str:
        if text not in allowed:
            raise argparse.ArgumentTypeError(f"must be one of {', '.join(allowed)}, got {text!r}")
        return text

    return choose
