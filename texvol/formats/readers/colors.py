"""Colour samples: three or four components as straight linear colour and an amount.

Integers are sRGB-encoded, floats are linear. The amount is the fourth component, opacity; without it, the brightest
component, encoded, so that black is empty. Colours in files have no opacity multiplied in, unless the file says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, check_size
from texvol.util.color import linear_from_srgb, srgb_from_linear

_COMPONENTS = (3, 4)
_BYTES = 4 * 4  # of a sample: three of colour and the amount, single precision
# Integers of at most so many bits are converted by a table.
_MOST_BITS = 16
_INSTEAD = "--channel N reads one component as numbers"


def with_color(axes: str, sizes: Sequence[int], at: int | None, choice: Choice, said: str) -> str:
    """Return the axes for `pick`, with "K" for axis `at` if its components are read as colour.

    Parameters
    ----------
    at : int, optional
        Axis of the components; None if there is none.
    said : str
        Name of the file's field that marks them as colour; empty if none does.

    Raises
    ------
    FileFault
        If --color is given and the components can't be colour.
    """
    wanted = choice.color is True
    if not wanted and (not said or choice.color is False or choice.labels or choice.channel is not None):
        return axes
    if at is None or int(sizes[at]) not in _COMPONENTS:
        if not wanted:
            return axes
        found = "its samples are single numbers" if at is None else f"its samples have {sizes[at]}"
        raise FileFault(f"--color needs 3 or 4 components, and {found}")
    return axes[:at] + "K" + axes[at + 1 :]


def is_colored(axes: str) -> bool:
    """True if the components along one of the axes are colour."""
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
    """Return values, colours and notes of `Samples`.

    Parameters
    ----------
    picked : array of 4 axes
        Samples along `axes` at `index`.
    said : str
        Name of the file's field that marks them as colour; empty if --color does.
    bits : int, optional
        Used bits of an integer, if not all.
    associated : bool
        True if the file's colours have opacity multiplied in.
    """
    kept = "".join(axis for axis, part in zip(axes, index, strict=True) if isinstance(part, slice))
    components = np.moveaxis(picked, kept.index("K"), -1)
    dtype = components.dtype
    if dtype.kind != "f" and (dtype.kind != "u" or dtype.itemsize * 8 > _MOST_BITS):
        raise FileFault(f"colour ({said or '--color'}) must be uint8, uint16 or floats, got {dtype}; {_INSTEAD}")
    check_size(components.shape[:3], _BYTES)
    colors = np.empty((*components.shape[:3], 3), np.float32)
    amounts = np.empty(components.shape[:3], np.float32)
    convert = _from_floats if dtype.kind == "f" else _from_whole
    # Slice by slice, so that wide intermediates never have the size of the volume.
    for source, color, amount in zip(components, colors, amounts, strict=True):
        color[...], amount[...] = convert(source, bits or dtype.itemsize * 8, associated)
    return {"values": amounts, "colors": colors, "notes": _notes(components, said, bits, associated)}


def _from_whole(source: NDArray, bits: int, associated: bool) -> tuple[NDArray, NDArray]:
    most = 2**bits - 1
    if int(source.max()) > most:
        raise FileFault(f"its colours must fit in {bits} bits, got {source.max()}; {_INSTEAD}")
    if associated and source.shape[-1] == 4:
        fractions = source.astype(np.float64) / most
        return linear_from_srgb(_unassociated(fractions)), fractions[..., 3]
    amounts = source[..., 3] if source.shape[-1] == 4 else source.max(axis=-1)
    linear, encoded = _tables(bits)
    return linear[source[..., :3]], encoded[amounts]


@cache
def _tables(bits: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return linear light of each integer, and its fraction of the largest."""
    fractions = np.arange(2**bits) / (2**bits - 1)
    return linear_from_srgb(fractions).astype(np.float32), fractions.astype(np.float32)


def _from_floats(source: NDArray, bits: int, associated: bool) -> tuple[NDArray, NDArray]:
    missing = np.isnan(source).any(axis=-1)
    numbers = np.where(missing[..., np.newaxis], 0, source.astype(np.float64))
    low, high = float(numbers.min()), float(numbers.max())
    if low < 0 or high > 1:
        raise FileFault(f"colours in floats must be in [0, 1], got {low:g} to {high:g}; {_INSTEAD}")
    with_opacity = numbers.shape[-1] == 4
    colors = _unassociated(numbers) if associated and with_opacity else numbers[..., :3]
    amounts = numbers[..., 3] if with_opacity else srgb_from_linear(numbers.max(axis=-1))
    return colors, np.where(missing, np.nan, amounts)


def _unassociated(fractions: NDArray) -> NDArray:
    """Return straight colour from colour with opacity multiplied in; black where the opacity is 0."""
    opacity = fractions[..., 3:]
    straight = np.divide(fractions[..., :3], opacity, out=np.zeros_like(fractions[..., :3]), where=opacity > 0)
    return np.minimum(straight, 1)


def _notes(components: NDArray, said: str, bits: int | None, associated: bool) -> tuple[str, ...]:
    names = "red, green and blue" if components.shape[-1] == 3 else "red, green, blue and opacity"
    kind = "linear" if components.dtype.kind == "f" else f"sRGB of {bits or components.dtype.itemsize * 8} bits"
    if components.shape[-1] == 3:
        amount = "values are the brightest of the three, encoded as sRGB, so that black is empty"
    else:
        amount = "values are the opacity" + (", which is divided out of the colours" if associated else "")
    return (f"colours ({said or '--color'}): {names}, {kind}; {amount}",)


def component_axis(axes: str, sizes: Sequence[int], letters: str = "C?") -> int | None:
    """Return the axis that --color takes for components: the fastest of 3 or 4 samples, or the fastest."""
    others = [at for at, axis in enumerate(axes) if axis in letters]
    fitting = [at for at in others if int(sizes[at]) in _COMPONENTS]
    return max(fitting, default=max(others, default=None))
