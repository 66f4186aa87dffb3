"""Magnitude of vectors: the Euclidean length of all components of a sample, read one after the other.

Components are what `--channel` counts: an array of several components in a VTK file, an axis of channels or an unnamed
axis elsewhere. A sample of which one component is missing is missing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, NoChannel, Samples

MAGNITUDE = "magnitude"


def magnitudes(read_one: Callable[[Choice], Samples], choice: Choice) -> Samples:
    """Return samples with the lengths of vectors, in float32, or in float64 where the components need it.

    Parameters
    ----------
    read_one : callable
        Reads one component: the channel of its choice.

    Raises
    ------
    FileFault
        If the samples have a single component.
    """
    choice = choice._replace(kept=None)  # which is one component's
    first = read_one(choice._replace(channel=0))
    if choice.counting:
        return first
    length = _length_of(first.values)
    count = 1
    try:
        while True:
            component = read_one(choice._replace(channel=count)).values
            # hypot: squares of 1e200 would overflow.
            np.hypot(length, component, out=length)
            count += 1
    except NoChannel:
        if count == 1:
            raise FileFault(f"--channel {MAGNITUDE} needs several components, and its samples have one") from None
    return first._replace(values=length, notes=(*first.notes, f"values are lengths of {count} components"))


def _length_of(values: NDArray) -> NDArray:
    narrow = values.dtype.itemsize <= 2 or values.dtype == np.float32
    return np.abs(values.astype(np.float32 if narrow else np.float64))
