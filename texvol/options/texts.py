"""Converters of plain option values, and their parts that other converters share.

Converters raise argparse.ArgumentTypeError, which says what the value must be; the caller adds the name of the option.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.scene.air import HOUNSFIELD, Air, checked_air
from texvol.scene.cutting import ClipPlane, Range, checked_crop
from texvol.scene.lighting import checked_shadow_nodes
from texvol.scene.spaces import letters_of_space
from texvol.util.color import color_guess, color_of_text
from texvol.util.errors import InputError
from texvol.util.numbers import number_of
from texvol.util.suggestions import did_you_mean

ALL = "all"  # time steps, or pixels

T = TypeVar("T")


def numbers(text: str, form: str, *counts: int, finite: bool = True) -> tuple[float, ...]:
    """Return numbers separated by commas, as many as one of `counts`; `form` describes them in the error."""
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) not in counts or (finite and not all(map(math.isfinite, found))):
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return found


def is_number(value: Any) -> bool:
    """True for a number of a scene file."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def are_numbers(value: Any, count: int) -> bool:
    """True for an array of `count` numbers of a scene file."""
    return isinstance(value, list) and len(value) == count and all(map(is_number, value))


def as_text(value: Any) -> str:
    """Return a scene-file value as the text of the command line."""
    return ",".join(str(part) for part in value) if isinstance(value, list) else str(value)


def made(make: Callable[[], T], *, names_option: bool = False) -> T:
    """Return `make()`; drop the first word of its InputError if it repeats the option's name."""
    try:
        return make()
    except InputError as error:
        reason = str(error)
        raise argparse.ArgumentTypeError(reason.partition(": ")[2] if names_option else reason) from None


def size(text: str) -> tuple[int, int]:
    """Return (width, height) of "WIDTHxHEIGHT", or of one number for both."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*(?:[xX×,]\s*(\d{1,9})\s*)?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, such as 640x480, or one number for both, got {text!r}")
    return int(match[1]), int(match[2] or match[1])


def triple(text: str) -> tuple[float, float, float]:
    """Return the three numbers of "X,Y,Z"."""
    x, y, z = numbers(text, "three numbers X,Y,Z", 3, finite=False)
    return x, y, z


def is_word(text: str) -> bool:
    """True if a text begins as the name of a colour, or as #RRGGBB."""
    return re.match(r"\s*[#a-zA-Z]", text) is not None


def rgb(text: str, form: str, *counts: int) -> tuple[float, ...]:
    """Return linear RGB of a name such as white, of #RRGGBB, or numbers, as many as one of `counts` (3)."""
    if (named := color_of_text(text)) is not None:
        return named
    if is_word(text):
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}{color_guess(text)}")
    return numbers(text, form, *(counts or (3,)))


def color(text: str) -> tuple[float, float, float] | None:
    """Return linear RGB of "R,G,B", "#RRGGBB" or a name, or None for "transparent"."""
    if text.strip().lower() in ("transparent", "none"):
        return None
    if (named := color_of_text(text)) is not None:
        return named
    if is_word(text):
        form = "R,G,B, #RRGGBB, a name such as white, or transparent"
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}{color_guess(text)}")
    rgb = triple(text)
    if not all(0 <= each < np.inf for each in rgb):
        raise argparse.ArgumentTypeError(f"must be three numbers of at least 0, R,G,B, got {text!r}")
    return rgb


def dimensions(text: str) -> tuple[int, int, int]:
    """Return (nx, ny, nz) of "NX,NY,NZ"."""
    match = re.fullmatch(r"\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"must be NX,NY,NZ, such as 256,256,128, got {text!r}")
    return int(match[1]), int(match[2]), int(match[3])


def number(text: str) -> float:
    """Return a number."""
    return numbers(text, "a number", 1, finite=False)[0]


def error_limit(text: str) -> float:
    """Return a number, which may be a fraction such as 1/255."""
    try:
        return number_of(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number or a fraction, such as 1/255, got {text!r}") from None


def air(text: str) -> Air:
    """Return the value of air: a number, "hounsfield", or None for "none"."""
    word = text.strip().lower()
    if word in ("none", HOUNSFIELD):
        return None if word == "none" else HOUNSFIELD
    try:
        return checked_air(float(text))
    except ValueError:  # InputError is one
        near = did_you_mean(word, (HOUNSFIELD, "none"))
        raise argparse.ArgumentTypeError(f"must be a finite number, {HOUNSFIELD} or none, got {text!r}{near}") from None


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
    # An exabyte is more than any device has, and still exact in bytes.
    return _number_if(text, lambda value: 0 < value < 1e12, "a number of megabytes over 0 and under 1e12")


def memory(text: str) -> int:
    """Return bytes of "4GB", "500 MB" or a number of bytes."""
    form = "a number of bytes, such as 4GB, 500MB or 2e9"
    match = re.fullmatch(r"\s*([\d.]+(?:e\+?\d{1,2})?)\s*(?:([kmgt]?)(i?)b)?\s*", text, re.IGNORECASE)
    try:
        count = float(match[1]) if match else -1.0
    except ValueError:
        count = -1.0
    if match and match[2]:
        count *= (1024 if match[3] else 1000) ** (" kmgt".index(match[2].lower()))
    if not 0 < count < 2**63:
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return int(count)


def level(text: str) -> int | str:
    """Return a level's number, at least 0, or "auto"."""
    return "auto" if text.strip().lower() == "auto" else index(text)


def transmittance(text: str) -> float:
    """Return a transmittance, at least 0 and under 1."""
    return _number_if(text, lambda value: 0 <= value < 1, "a transmittance of at least 0 and under 1")


def refinement(text: str) -> int | str:
    """Return a refinement of textures: 1, 2, 4 or auto."""
    if text not in ("1", "2", "4", "auto"):
        raise argparse.ArgumentTypeError(f"must be 1, 2, 4 or auto, got {text!r}")
    return text if text == "auto" else int(text)


def shadow_nodes(text: str) -> int | str:
    """Return a number of nodes of shadows, or auto."""
    return text if text == "auto" else made(lambda: checked_shadow_nodes(count(text, "nodes")))


def zoom(text: str) -> float:
    """Return a factor of sizes."""
    return _number_if(text, lambda value: 1e-3 <= value <= 1e3, "a factor from 0.001 to 1000")


def value_range(text: str) -> tuple[float, float]:
    """Return the two values of "LOW,HIGH", of which the first is the smaller one."""
    low, high = numbers(text, "two values LOW,HIGH", 2)
    if not low < high:
        raise argparse.ArgumentTypeError(f"must be LOW,HIGH with LOW under HIGH, got {text!r}")
    return low, high


def opacity_factor(text: str) -> float:
    """Return a factor of extinctions."""
    return _number_if(text, lambda value: 0 <= value <= 1e6, "a factor from 0 to 1e6")


def positive_length(text: str) -> float:
    """Return a length in world units."""
    return _number_if(text, lambda value: 0 < value <= 1e30, "a length above 0")


def unit(text: str) -> str:
    """Return the name of a unit."""
    if not re.fullmatch(r"[^\s\x00-\x1f]{1,20}", text.strip()):
        raise argparse.ArgumentTypeError(f"must be the name of a unit, such as mm, got {text!r}")
    return text.strip()


def space(text: str) -> str:
    """Return the names of three directions of the body."""
    if letters_of_space(text.strip()) is None:
        form = "three directions of the body, such as right-anterior-superior"
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return text.strip().lower()


def frames_per_second(text: str) -> float:
    """Return frames per second of a film."""
    return _number_if(text, lambda value: 0.1 <= value <= 1000, "frames per second from 0.1 to 1000")


def _number_if(text: str, is_valid: Callable[[float], bool], form: str) -> float:
    value = number(text)
    if not is_valid(value):
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return value


def count(text: str, what: str) -> int:
    """Return a number of things, at least 1."""
    if not re.fullmatch(r"\s*\+?\d{1,9}\s*", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a number of {what}, at least 1, got {text!r}")
    return int(text)


def orbit(text: str) -> tuple[int, int]:
    """Return the views around and the rows of "N" or "NxROWS"."""
    found = re.fullmatch(r"\s*\+?(\d{1,9})\s*(?:[xX×]\s*(\d{1,3})\s*)?", text)
    columns, rows = (int(found[1]), int(found[2] or 1)) if found else (0, 0)
    if columns < 1 or rows < 1:
        form = "a number of views, at least 1, or views around and rows, such as 72x9"
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return columns, rows


def pixels(text: str) -> int | str:
    """Return a number of pixels, at least 1, or "all"."""
    return ALL if text.strip().lower() == ALL else count(text, "pixels")


def index(text: str) -> int:
    """Return a whole number of at least 0."""
    if not re.fullmatch(r"\s*\+?\d{1,18}\s*", text):
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 0, got {text!r}")
    return int(text)


def channel(text: str) -> int | str:
    """Return a channel, at least 0, or "magnitude"."""
    return MAGNITUDE if text.strip().lower() == MAGNITUDE else index(text)


def time_step(text: str) -> int | str:
    """Return a time step, at least 0, or "all"."""
    return ALL if text.strip().lower() == ALL else index(text)


def file_name(text: str) -> str:
    """Return the name of an output file; an empty name, as of an unset shell variable, is an error."""
    if not text:
        raise argparse.ArgumentTypeError("must be the name of a file, got ''")
    return text


def clip_plane(text: str) -> ClipPlane:
    """Return the plane of "NX,NY,NZ,D"."""
    x, y, z, offset = numbers(text, "four numbers NX,NY,NZ,D", 4, finite=False)
    return made(lambda: ClipPlane((x, y, z), offset))


def clip_plane_table(table: Mapping[str, Any]) -> ClipPlane:
    """Return the plane of a scene file's {normal = [NX, NY, NZ], offset = D}."""
    if set(table) != {"normal", "offset"}:
        raise argparse.ArgumentTypeError(f"must be {{normal = [X, Y, Z], offset = D}}, got {dict(table)!r}")
    normal, offset = table["normal"], table["offset"]
    if not isinstance(normal, list) or len(normal) != 3:
        raise argparse.ArgumentTypeError(f"clip plane: normal must be three numbers, got {normal!r}")
    for each in (*normal, offset):
        if not is_number(each):
            raise argparse.ArgumentTypeError(f"clip plane: normal and offset must be numbers, got {each!r}")
    x, y, z = map(float, normal)
    return made(lambda: ClipPlane((x, y, z), float(offset)))


def crop_box(text: str) -> tuple[Range, Range, Range]:
    """Return the three ranges of "X0,X1,Y0,Y1,Z0,Z1"."""
    ends = numbers(text, "six numbers X0,X1,Y0,Y1,Z0,Z1", 6, finite=False)
    return made(lambda: checked_crop((ends[0:2], ends[2:4], ends[4:6])))


class Choice:
    """Converter that accepts only some `words`."""

    def __init__(self, *words: str) -> None:
        self.words = words

    def __call__(self, text: str) -> str:
        if text not in self.words:
            near = did_you_mean(text, self.words)
            raise argparse.ArgumentTypeError(f"must be one of {', '.join(self.words)}, got {text!r}{near}")
        return text


def with_negative_values(line: Sequence[str]) -> list[str]:
    """Return the line with `--eye -1,2,3` as `--eye=-1,2,3`, since argparse takes `-1,2,3` for an option."""
    joined: list[str] = []
    for word in line:
        after_option = joined and joined[-1].startswith("--") and "=" not in joined[-1] and len(joined[-1]) > 2
        if after_option and re.match(r"-[\d.]", word):
            joined[-1] += "=" + word
        else:
            joined.append(word)
    return joined
