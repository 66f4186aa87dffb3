"""sRGB encoding and linear light (IEC 61966-2-1)."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

# Names of which a misspelt one is looked for: 148 of CSS would suggest colours that nobody meant.
_COMMON = (
    "black", "white", "grey", "gray", "red", "green", "blue", "yellow", "orange", "purple", "violet", "magenta", "cyan",
    "brown", "pink", "navy", "silver", "gold", "beige",
)  # fmt: skip


def srgb_from_linear(linear: NDArray) -> NDArray:
    """sRGB encoding (IEC 61966-2-1) of linear light, clipped to [0, 1]."""
    linear = np.clip(np.nan_to_num(linear), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def linear_from_srgb(encoded: NDArray) -> NDArray:
    """Linear light of sRGB values in [0, 1] (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def color_of_text(text: str) -> tuple[float, float, float] | None:
    """Return the linear colour of a name such as "white", of #RRGGBB or of #RGB; None of any other text.

    Names are those of CSS, as the library of colour maps knows them.
    """
    word = text.strip().lower()
    if re.fullmatch(r"#[0-9a-f]{6}|#[0-9a-f]{3}", word):
        digits = word[1:] if len(word) == 7 else "".join(2 * digit for digit in word[1:])
        encoded = np.array(list(bytes.fromhex(digits))) / 255
    elif re.fullmatch(r"[a-z]+", word):
        found = _named(word)
        if found is None:
            return None
        encoded = np.array(found)
    else:
        return None
    red, green, blue = linear_from_srgb(encoded).tolist()
    return red, green, blue


def color_guess(text: str) -> str:
    """Return "; did you mean 'white'?" for what may be a misspelt name of a colour, or ""."""
    return did_you_mean(text, _COMMON)


def linear_color(color: ArrayLike, what: str) -> tuple[float, float, float]:
    """Return a linear colour: three finite numbers of at least 0, or a text as `color_of_text` takes it.

    Raises
    ------
    InputError
        If it is none; `what` begins the message.
    """
    numbers = np.asarray(color_of_text(color) if isinstance(color, str) else color)
    is_color = numbers.shape == (3,) and numbers.dtype.kind in "iuf"
    if not is_color or not ((numbers >= 0) & (numbers < np.inf)).all():
        wanted = "three numbers of at least 0, #RRGGBB or a name such as white"
        guess = color_guess(color) if isinstance(color, str) else ""
        raise InputError(f"{what} must be {wanted}, got {color!r}{guess}")
    red, green, blue = numbers.astype(np.float64).tolist()
    return red, green, blue


def linear_colors(colors: Any, what: str) -> Any:
    """Return colours, with those that are texts in linear light, see `linear_color`."""
    if isinstance(colors, np.ndarray) or not any(isinstance(each, str) for each in colors):
        return colors
    return [linear_color(each, what) if isinstance(each, str) else each for each in colors]


def _named(word: str) -> tuple[float, float, float] | None:
    """Return the sRGB colour of a name, from 0 to 1, or None."""
    from cmap import Color

    try:
        red, green, blue, opacity = Color(word).rgba
    except (ValueError, TypeError):
        return None
    return (red, green, blue) if opacity == 1 else None
