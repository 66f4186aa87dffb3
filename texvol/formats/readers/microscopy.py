"""Tools of the microscopes' formats: images of a file, planes of a stack, channels and lengths in micrometres.

As of other images, the first channel is read where none is chosen, and all of them are described.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.channels import note, with_first
from texvol.formats.readers.samples import Choice, FileFault, check_size, pick
from texvol.scene.channel import Channel
from texvol.util.color import linear_from_srgb

_MOST_NAMED = 12


def chosen_image(names: Sequence[str], choice: Choice) -> int:
    """Return the number of the image that --image names, or 0 if there is one."""
    listed = ", ".join(f"{number} {name}".strip() for number, name in enumerate(names[:_MOST_NAMED]))
    if choice.image is None:
        if len(names) > 1:
            raise FileFault(f"has {len(names)} images: {listed}; --image N or NAME chooses one")
        return 0
    wanted = str(choice.image)
    if wanted in names:
        numbers = [number for number, name in enumerate(names) if name == wanted]
        if len(numbers) > 1:
            listed = ", ".join(map(str, numbers[:_MOST_NAMED]))
            raise FileFault(f"has {len(numbers)} images of the name {wanted}: --image N chooses one of {listed}")
        return numbers[0]
    if wanted.isdigit() and int(wanted) < len(names):
        return int(wanted)
    raise FileFault(f"has no image {wanted} (--image); it has {listed}")


def stack(
    sizes: dict[str, int], dtype: np.dtype, choice: Choice, plane: Callable[[int, int, int], NDArray]
) -> tuple[NDArray, int]:
    """Return the planes of the chosen channel and time as a volume, and the channel's number.

    Parameters
    ----------
    sizes : dict
        Of the axes T, C, Z, Y and X.
    plane : callable
        Returns the plane of a time step, channel and slice, shape (Y, X).
    """
    axes = [sizes[letter] for letter in "TCZYX"]
    time, channel, *_ = pick("TCZYX", axes, with_first("TCZYX", axes, choice))
    assert isinstance(time, int) and isinstance(channel, int)
    shape = (sizes["Z"], sizes["Y"], sizes["X"])
    check_size(shape, dtype.itemsize)
    values = np.empty(shape, dtype)
    for number in range(sizes["Z"]):
        found = np.asarray(plane(time, channel, number))
        if found.shape != shape[1:]:
            raise FileFault(f"plane {number} must have {shape[2]} x {shape[1]} pixels, got shape {found.shape}")
        values[number] = found
    return values, channel


def note_on_missing(missing: Sequence[int], count: int, chosen: str) -> tuple[str, ...]:
    """Return a note on slices that the file does not have; raise FileFault if it has none of what was chosen."""
    if len(missing) == count:
        raise FileFault(f"has no pixels of {chosen}")
    listed = ", ".join(map(str, missing[:_MOST_NAMED])) + (", …" if len(missing) > _MOST_NAMED else "")
    return (f"{len(missing)} of {count} slices are not in the file and are 0: {listed}",) if missing else ()


def spacing_of(lengths: Sequence[Any]) -> dict[str, Any]:
    """Return spacing, direction and unit of steps x, y, z in micrometres; those that are not told are 1.

    A negative step is an axis that points the other way.
    """
    known = [each is not None and np.isfinite(float(each)) and float(each) != 0 for each in lengths]
    steps = [float(each) if is_known else 1.0 for each, is_known in zip(lengths, known, strict=True)]
    grid = {"spacing": np.abs(steps), "direction": np.diag(np.sign(steps))}
    return {**grid, "unit": "µm" if any(known) else ""}


def of_channel(number: int, count: int, names: Sequence[str], colors: Sequence[Any]) -> dict[str, Any]:
    """Return fields of `Samples` of a channel of several: itself, all of them, and a note.

    Parameters
    ----------
    count : int
        Channels of the image. Names and colours that are not as many are those of something else, and ignored.
    colors : sequence
        Of each channel three sRGB numbers from 0 to 1, or None.
    """
    if count < 2:
        return {}
    if not len(names) == len(colors) == count:
        names, colors = [""] * count, [None] * count
    found = []
    for each, (name, color) in enumerate(zip(names, colors, strict=True)):
        linear = None if color is None else linear_from_srgb(np.clip(np.array(color, np.float64), 0, 1)).tolist()
        found.append(Channel(each, name, None if linear is None else (linear[0], linear[1], linear[2])))
    return {"channels": tuple(found), "channel": found[number], "notes": note(found, number)}
