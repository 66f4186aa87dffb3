"""Samples of three or four components that a file calls colour: straight linear colour, and how much of it there is.

Whole numbers are sRGB-encoded, floats are linear. The fourth component is opacity; without it there is as much of a
sample as its brightest component says, encoded, so that black is nothing. Opacity has not been multiplied into colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, check_size

_COMPONENTS = (3, 4)
_BYTES = 4 * 4  # of a sample: three of colour and how much of it, single precision
# Whole numbers of so many bits are looked up in a table.
_MOST_BITS = 16
_INSTEAD = "--channel N reads one of them as numbers"


def with_color(axes: str, sizes: Sequence[int], at: int | None, choice: Choice, said: str) -> str:
    """The axes of `pick`, with "K" for what lies along axis `at` if it is read as colour.

    Parameters
    ----------
    at : int, optional
        Where the components lie; None if there are none.
    said : str
        By what the file calls them colour; empty if it does not.

    Raises
    ------
    FileFault
        If they are to be read as colour and can't be.
    """
    wanted = choice.color is True
    if not wanted and (not said or choice.color is False or choice.labels or choice.channel is not None):
        return axes
    if at is None or int(sizes[at]) not in _COMPONENTS:
        if not wanted:
            return axes
        found = "a sample is one number" if at is None else f"its samples have {sizes[at]}"
        raise FileFault(f"--color: a colour has 3 or 4 components, and {found}")
    return axes[:at] + "K" + axes[at + 1 :]


def is_colored(axes: str) -> bool:
    """Whether the components along one of the axes are colour."""
    return "K" in axes


def colored(
    picked: NDArray,
    axes: str,
    index: Sequence[int | slice],
    said: str,
    *,
    bits: int | None = None,
    associated: bool = False,
) -> dict[str, Any]:
    """Values, colours and notes of `Samples`.

    Parameters
    ----------
    picked : array of 4 axes
        What `index` has left of the samples along `axes`.
    said : str
        By what the file calls them colour; empty if the user does.
    bits : int, optional
        How many of a whole number's bits are used, unless all are.
    associated : bool
        Whether the file says that opacity has been multiplied into its colours.
    """
    kept = "".join(axis for axis, part in zip(axes, index, strict=True) if isinstance(part, slice))
    components = np.moveaxis(picked, kept.index("K"), -1)
    _check_type(components.dtype, said)
    check_size(components.shape[:3], _BYTES)
    colors = np.empty((*components.shape[:3], 3), np.float32)
    amounts = np.empty(components.shape[:3], np.float32)
    convert = _from_floats if components.dtype.kind == "f" else _from_whole
    # Slice by slice, so that the wide intermediates never have the size of the volume.
    for source, color, amount in zip(components, colors, amounts, strict=True):
        color[...], amount[...] = convert(source, bits or components.dtype.itemsize * 8, associated)
    return {"values": amounts, "colors": colors, "notes": _notes(components, said, bits, associated)}


def _check_type(dtype: np.dtype, said: str) -> None:
    if dtype.kind == "f" or (dtype.kind == "u" and dtype.itemsize * 8 <= _MOST_BITS):
        return
    who = said or "--color"
    raise FileFault(f"its samples are {dtype}, and colour ({who}) is uint8, uint16 or floats; {_INSTEAD}")


def _from_whole(source: NDArray, bits: int, associated: bool) -> tuple[NDArray, NDArray]:
    from texvol.util.color import linear_from_srgb

    most = 2**bits - 1
    if int(source.max()) > most:
        raise FileFault(f"its colours have {bits} bits, and {source.max()} is among them; {_INSTEAD}")
    if associated and source.shape[-1] == 4:
        fractions = source.astype(np.float64) / most
        return linear_from_srgb(_unassociated(fractions)), fractions[..., 3]
    amounts = source[..., 3] if source.shape[-1] == 4 else source.max(axis=-1)
    linear, encoded = _tables(bits)
    return linear[source[..., :3]], encoded[amounts]


@cache
def _tables(bits: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Linear light of each whole number, and its share of the largest."""
    from texvol.util.color import linear_from_srgb

    fractions = np.arange(2**bits) / (2**bits - 1)
    return linear_from_srgb(fractions).astype(np.float32), fractions.astype(np.float32)


def _from_floats(source: NDArray, bits: int, associated: bool) -> tuple[NDArray, NDArray]:
    from texvol.util.color import srgb_from_linear

    missing = np.isnan(source).any(axis=-1)
    numbers = np.where(missing[..., np.newaxis], 0, source.astype(np.float64))
    low, high = float(numbers.min()), float(numbers.max())
    if low < 0 or high > 1:
        raise FileFault(f"colours in floats lie in [0, 1], and its go from {low:g} to {high:g}; {_INSTEAD}")
    with_opacity = numbers.shape[-1] == 4
    colors = _unassociated(numbers) if associated and with_opacity else numbers[..., :3]
    amounts = numbers[..., 3] if with_opacity else srgb_from_linear(numbers.max(axis=-1))
    return colors, np.where(missing, np.nan, amounts)


def _unassociated(fractions: NDArray) -> NDArray:
    """Straight colour of shares that opacity has been multiplied into; black where there is none."""
    opacity = fractions[..., 3:]
    straight = np.divide(fractions[..., :3], opacity, out=np.zeros_like(fractions[..., :3]), where=opacity > 0)
    return np.minimum(straight, 1)


def _notes(components: NDArray, said: str, bits: int | None, associated: bool) -> tuple[str, ...]:
    names = "red, green and blue" if components.shape[-1] == 3 else "red, green, blue and opacity"
    kind = "linear" if components.dtype.kind == "f" else f"sRGB of {bits or components.dtype.itemsize * 8} bits"
    if components.shape[-1] == 3:
        amount = "values are the brightest of the three, encoded as sRGB, so that black is nothing"
    else:
        amount = "values are the opacity" + (", which is divided out of the colours" if associated else "")
    return (f"colours ({said or '--color'}): {names}, {kind}; {amount}",)


def component_axis(axes: str, sizes: Sequence[int], letters: str = "C?") -> int | None:
    """The axis that --color means where the file says of none: the fastest of 3 or 4 components, or the fastest."""
    others = [at for at, axis in enumerate(axes) if axis in letters]
    fitting = [at for at in others if int(sizes[at]) in _COMPONENTS]
    return max(fitting, default=max(others, default=None))
