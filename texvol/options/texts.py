"""Texts of plain options and what they become; each says with argparse.ArgumentTypeError what it wants."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable

import numpy as np

from texvol.scene.air import HOUNSFIELD, Air, checked_air

ALL = "all"  # time steps, or pixels


def size(text: str) -> tuple[int, int]:
    """(width, height) from "WxH"."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×,]\s*(\d{1,9})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"a size is WxH in pixels, such as 640x480, and not {text!r}")
    return int(match[1]), int(match[2])


def triple(text: str) -> tuple[float, float, float]:
    """Three finite numbers from "X,Y,Z"."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"three numbers X,Y,Z are wanted, and not {text!r}")
    return numbers


def color(text: str) -> tuple[float, float, float] | None:
    """Linear RGB from "R,G,B", or None from "transparent"."""
    if text.strip().lower() in ("transparent", "none"):
        return None
    numbers = triple(text)
    if not all(0 <= number < np.inf for number in numbers):
        raise argparse.ArgumentTypeError(f"a colour is three numbers from 0 upwards, and not {text!r}")
    return numbers


def dimensions(text: str) -> tuple[int, int, int]:
    """(nx, ny, nz) from "NX,NY,NZ"."""
    match = re.fullmatch(r"\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"a shape is NX,NY,NZ, and not {text!r}")
    return int(match[1]), int(match[2]), int(match[3])


def number(text: str) -> float:
    """A number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number is wanted, and not {text!r}") from None


def air(text: str) -> Air:
    """The value of air, "hounsfield", or None from "none"."""
    word = text.strip().lower()
    if word in ("none", HOUNSFIELD):
        return None if word == "none" else HOUNSFIELD
    try:
        return checked_air(float(text))
    except ValueError:  # InputError is one
        wanted = f"a finite number, {HOUNSFIELD} or none"
        raise argparse.ArgumentTypeError(f"the value of air must be {wanted}, got {text!r}") from None


def sample_value(text: str) -> int | float:
    """A value that samples may have: an integer with all its digits, or a number."""
    if re.fullmatch(r"\s*[+-]?\d{1,40}\s*", text):
        return int(text)
    wanted = number(text)
    if np.isnan(wanted):
        raise argparse.ArgumentTypeError("the value must be a number, got NaN: samples that are NaN are missing anyway")
    return wanted


def sample_values(value: object) -> list[int | float]:
    """Values that samples may have, from a scene file's number or array of numbers."""
    several = value if isinstance(value, list) else [value]
    if any(isinstance(each, bool) or not isinstance(each, int | float | str) for each in several):
        raise argparse.ArgumentTypeError(f"the values must be a number or an array of numbers, got {value!r}")
    return [sample_value(each if isinstance(each, str) else repr(each)) for each in several]


def megabytes(text: str) -> float:
    """Megabytes of texture memory."""
    wanted = number(text)
    if not 0 < wanted < 1e12:  # an exabyte: more than any device has, and its bytes are still a number
        raise argparse.ArgumentTypeError(f"megabytes between 0 and 1e12 are wanted, and not {text!r}")
    return wanted


def transmittance(text: str) -> float:
    """A transmittance from 0 to under 1."""
    wanted = number(text)
    if not 0 <= wanted < 1:
        raise argparse.ArgumentTypeError(f"a transmittance from 0 to under 1 is wanted, and not {text!r}")
    return wanted


def views(text: str) -> int:
    """How many views an orbit has."""
    return _count(text, "views")


def frames(text: str) -> int:
    """How many frames a window shows."""
    return _count(text, "frames")


def _count(text: str, what: str) -> int:
    if not re.fullmatch(r"\s*\+?\d{1,9}\s*", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a number of {what} from 1 upwards is wanted, and not {text!r}")
    return int(text)


def pixels(text: str) -> int | str:
    """Number of pixels from 1, or "all"."""
    return ALL if text.strip().lower() == ALL else _count(text, "pixels")


def frames_per_second(text: str) -> float:
    """Frames per second of a film."""
    wanted = number(text)
    if not 0.1 <= wanted <= 1000:
        raise argparse.ArgumentTypeError(f"frames per second from 0.1 to 1000 are wanted, and not {text!r}")
    return wanted


def index(text: str) -> int:
    """A whole number from 0."""
    if not re.fullmatch(r"\s*\+?\d{1,18}\s*", text):
        raise argparse.ArgumentTypeError(f"a whole number from 0 is wanted, and not {text!r}")
    return int(text)


def time_step(text: str) -> int | str:
    """A time step from 0, or all of them."""
    return ALL if text.strip().lower() == ALL else index(text)


def file_name(text: str) -> str:
    """The name of a file to be written: a variable of a shell that is not set would quietly write none."""
    if not text:
        raise argparse.ArgumentTypeError("the name of a file is wanted, and not ''")
    return text


def choice(*allowed: str) -> Callable[[str], str]:
    """What takes one of these words."""

    def choose(text: str) -> str:
        if text not in allowed:
            raise argparse.ArgumentTypeError(f"one of {', '.join(allowed)} is wanted, and not {text!r}")
        return text

    return choose
