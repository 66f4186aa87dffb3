"""Tools that readers share: samples and their grid, limits on sizes in headers, further axes, rescaling."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.channel import Channel
from texvol.scene.label_table import LabelTable
from texvol.scene.large_volume import Level
from texvol.util.memory import free_memory
from texvol.util.remarks import Noted

T = TypeVar("T")

# Compressed samples may be at most so many times as large: deflate reaches 1032, LZW 1365, JPEG 2000 and LZMA some
# thousands if almost all samples are 0. Sizes below the second constant are never refused.
_BEST_PACKING = 10000
_UNPACKED_ANYWAY = 2**26


class FileFault(Exception):
    """Fault of the file being read, without the file's name, which `load` adds."""


class NoChannel(FileFault):
    """Choice of a channel that does not exist."""


class TimeSteps(Exception):
    """Number of time steps of a file, and True if its components are colours; raised by a reader if `Choice.counting`.

    The second argument may be left out by formats that have no colours.
    """


class AxisLength(Exception):
    """Number of channels or time steps of a file, 0 without such an axis; raised where `COUNTED` is chosen."""


COUNTED = 2**62  # a channel or time step that no file has: a reader that is asked for it says how many there are


class Choice(NamedTuple):
    """Arguments of `texvol.formats.readers.load`; a reader gets them `checked`: `series` is text, `missing` a tuple.

    With `counting` a reader raises TimeSteps as soon as it knows them. In `kept` a reader may store, under keys of its
    own, what the next step of the same file needs again.
    """

    shape: Sequence[int] | None = None
    dtype: str | None = None
    series: Any = None
    channel: Any = None  # a number; readers never get "magnitude"
    time: int | None = None
    variable: str | None = None
    resolution: Sequence[int] | None = None
    spacing: Sequence[float] | None = None
    labels: bool = False
    blocks: bool = False
    color: bool | None = None
    missing: Any = ()
    image: Any = None
    level: Any = None
    fix_pyramid: bool = False
    missing_chunks: bool = False
    memory: int | None = None
    label_names: str | None = None
    resample: bool = False
    counting: bool = False
    kept: dict[Any, Any] | None = None


class Samples(NamedTuple):
    """Result of a reader: unchecked values of shape (nz, ny, nx), and the grid as in `Volume`.

    `resampling`, `notes` and `colors` are as in `Volume`; `times` are those of all steps, in `time_unit`, if the file
    has them. `channel` is the one that is read of the described `channels`, where there are several. Of a store there
    are `levels` in place of values, and as in `LargeVolume` `images` and `check`; `labels` is True if the file says
    that its values are, and `label_table` has their names and colours if it tells them.
    """

    values: NDArray
    spacing: Sequence[float] = (1.0, 1.0, 1.0)
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    direction: ArrayLike | None = None
    unit: str = ""
    value_unit: str = ""
    space: str = ""
    resampling: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()
    times: Sequence[float] | None = None
    time_unit: str = ""
    colors: NDArray | None = None
    labels: bool = False
    label_table: LabelTable | None = None
    levels: tuple[Level, ...] = ()
    channel: Channel | None = None
    channels: tuple[Channel, ...] = ()
    images: tuple[str, ...] = ()
    check: Noted | None = None

    @classmethod
    def of_levels(
        cls,
        levels: tuple[Level, ...],
        spacing: Any = (1.0, 1.0, 1.0),
        origin: Any = (0.0, 0.0, 0.0),
        **more: Any,
    ) -> Samples:
        """Return samples that stay in a store."""
        return cls(np.empty((0, 0, 0)), spacing, origin, levels=levels, **more)


def once(choice: Choice, key: Any, make: Callable[[], T]) -> T:
    """Return `make()`; in a series, the result for the first step is kept under `key` and returned again."""
    if choice.kept is None:
        return make()
    if key not in choice.kept:
        choice.kept[key] = make()
    return choice.kept[key]


def check_size(sizes: Sequence[int], item_bytes: int) -> int:
    """Return the bytes of an array of these sizes; raise FileFault if a size is not positive or memory is too small."""
    sizes = [int(size) for size in sizes]
    if any(size < 1 for size in sizes):
        raise FileFault(f"every dimension must be positive, got {by(sizes)}")
    needed = prod(sizes) * item_bytes
    available = free_memory()
    if needed > available:
        room = in_bytes(available)
        raise FileFault(f"{by(sizes)} samples need {in_bytes(needed)} of memory, and this machine has {room}")
    return needed


def check_chunk(sizes: Sequence[int], item_bytes: int) -> None:
    """Raise FileFault unless a chunk of these sizes, which is decoded at once, fits into half of the free memory."""
    room = free_memory() // 2
    if (needed := prod(map(int, sizes)) * item_bytes) > room:
        raise FileFault(f"its chunks of {by(sizes)} need {in_bytes(needed)} of memory, and there is {in_bytes(room)}")


def check_unpacked(needed: int, packed: int) -> None:
    """Raise FileFault if `packed` compressed bytes can't plausibly hold `needed` bytes."""
    if needed > _UNPACKED_ANYWAY + _BEST_PACKING * packed:
        raise FileFault(
            f"holds {in_bytes(packed)}, but its header's dimensions need {in_bytes(needed)}: more than {_BEST_PACKING} "
            "times the compressed size is not unpacked"
        )


def native(values: NDArray) -> NDArray:
    """Return `values` in the machine's byte order, swapped in place; nobody else may hold them."""
    if not values.dtype.isnative:
        values.byteswap(inplace=True)
    return values.view(values.dtype.newbyteorder("="))


def real_type(dtype: np.dtype) -> np.dtype:
    """Return `dtype` if it is a real number of at most 64 bits, else raise FileFault."""
    if dtype.kind == "c":
        raise FileFault(f"must hold real numbers, got complex numbers ({dtype})")
    if dtype.kind not in "iufb" or dtype.itemsize > 8:
        raise FileFault(f"must hold real numbers of at most 64 bits, got type {dtype}")
    return dtype


def pick(axes: str, sizes: Sequence[int], choice: Choice) -> tuple[int | slice, ...]:
    """Return the index that leaves the three axes of space, and the axis of colour if any.

    Parameters
    ----------
    axes : str
        A letter for each axis: "Z", "Y", "X", "C" for channel, "T" for time, "K" for colour, "?" for an unnamed axis,
        which either option indexes.
    sizes : sequence of int
        Samples along each axis.

    Raises
    ------
    FileFault
        If an axis of space is missing, or an option is missing, out of range, or without an axis.
    TimeSteps
        If `choice.counting`.
    AxisLength
        If the choice along an axis is COUNTED.
    """
    sizes = [int(size) for size in sizes]
    if choice.counting:
        raise TimeSteps(_steps(axes, sizes, choice), "K" in axes)
    wanted = {"C": choice.channel, "T": choice.time}
    index: list[int | slice] = []
    for axis, size in zip(axes, sizes, strict=True):
        if axis in "ZYXK":
            index.append(slice(None))
            continue
        names = [name for name in ("CT" if axis == "?" else axis) if wanted.get(name) is not None]
        if not names and size == 1:
            index.append(0)
            continue
        if not names:
            options = {"T": "--time", "C": "--channel"}.get(axis, "--channel")
            length = "" if options == "--time" else ", or the length of its vectors with --channel magnitude"
            raise FileFault(
                f"has {len(sizes)} axes ({_listed(axes, sizes)}); choose one with {options} 0..{size - 1}{length}"
            )
        chosen = wanted.pop(names[0])
        if chosen is None or not 0 <= chosen < size:
            raise out_of_range(names[0], chosen, size)
        index.append(chosen)
    for name, chosen in wanted.items():
        if chosen:
            raise without_axis(name, chosen, f"no {_NAMES[name]} axis ({_listed(axes, sizes)})")
    if [axis for axis in axes if axis in "ZYX"] != list("ZYX"):
        spatial = [size for axis, size in zip(axes, sizes, strict=True) if axis in "ZYX"]
        raise FileFault(f"must have 3 axes, got {len(spatial)} ({by(spatial[::-1])})")
    return tuple(index)


def _steps(axes: str, sizes: Sequence[int], choice: Choice) -> int:
    """Return the samples along the axis of time, or along an unnamed axis if no channel is chosen."""
    steps = [size for axis, size in zip(axes, sizes, strict=True) if axis == "T"]
    unnamed = [size for axis, size in zip(axes, sizes, strict=True) if axis == "?" and size > 1]
    if not steps and choice.channel is None:
        steps = unnamed
    if len(steps) > 1:
        raise FileFault(f"has {len(steps)} axes that could be time ({_listed(axes, sizes)})")
    return steps[0] if steps else 1


def without_axis(axis: str, chosen: int, has: str) -> Exception:
    """Return the fault of a choice along "C" or "T" of a file without that axis; `has` are words on what it has."""
    if chosen == COUNTED:
        return AxisLength(0)
    kind = NoChannel if axis == "C" else FileFault
    return kind(f"{_OPTIONS[axis]} {chosen}: the file has {has}")


def out_of_range(axis: str, chosen: int | None, size: int) -> Exception:
    """Return the fault of a choice along "C" or "T" that does not exist; the length of the axis if that is asked."""
    if chosen == COUNTED:
        return AxisLength(size)
    plural = "" if size == 1 else "s"
    kind = NoChannel if axis == "C" else FileFault
    return kind(f"{_OPTIONS[axis]} must be in 0..{size - 1}, got {chosen}: it has {size} {_COUNTED[axis]}{plural}")


_OPTIONS = {"C": "--channel", "T": "--time"}
_COUNTED = {"C": "channel", "T": "time step"}
_NAMES = {"C": "channel", "T": "time", "?": "unnamed", "Z": "z", "Y": "y", "X": "x", "K": "colour"}


def _listed(axes: str, sizes: Sequence[int]) -> str:
    return ", ".join(f"{_NAMES[axis]} {size}" for axis, size in zip(axes[::-1], sizes[::-1], strict=True))


def unnamed_axes(count: int) -> str:
    """Return letters for `pick` of an array with unnamed axes, slowest first: the last three are space."""
    return ("?" * (count - 3) + "ZYX")[-count:] if count else ""


def rescaled(values: NDArray, slope: float, intercept: float, bits: int | None = None) -> NDArray:
    """Return slope · values + intercept, in the smallest type that holds it exactly or with all its digits.

    With integer slope and intercept that is an integer type for the range of the stored type, or `bits` of it. Else it
    is float32 for up to 16 bits (24 bits of mantissa hold the steps), and float64 beyond; floats keep their type.
    """
    if not (np.isfinite(slope) and np.isfinite(intercept)) or slope == 0:
        raise FileFault(f"rescale slope {slope:g} and intercept {intercept:g}: both must be finite, the slope not 0")
    if slope == 1 and intercept == 0:
        return values
    result = np.empty(values.shape, rescaled_type(values.dtype, slope, intercept, bits))
    # Slice by slice, so that the wide intermediate never has the size of the volume.
    for source, slot in zip(values, result, strict=True):
        rescale_into(slot, source, slope, intercept)
    return result


def rescale_into(slot: NDArray, source: NDArray, slope: float, intercept: float) -> None:
    """Write slope · source + intercept to `slot`, whose type is that of `rescaled_type`."""
    if slot.dtype.kind in "iu":
        slot[...] = source.astype(np.int64) * int(slope) + int(intercept)
    else:
        slot[...] = source.astype(np.float64) * slope + intercept


def rescaled_type(dtype: np.dtype, slope: float, intercept: float, bits: int | None = None) -> np.dtype:
    """Return the type of the result of `rescaled`."""
    if slope == 1 and intercept == 0:
        return dtype
    if dtype.kind == "f":
        return np.dtype(np.float32 if dtype.itemsize <= 4 else np.float64)
    bits = dtype.itemsize * 8 if bits is None else bits
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if dtype.kind == "i" else (0, 2**bits - 1)
    if float(slope).is_integer() and float(intercept).is_integer():
        ends = sorted((low * int(slope) + int(intercept), high * int(slope) + int(intercept)))
        for kind in ("u1", "i1", "u2", "i2", "u4", "i4", "i8"):
            candidate = np.iinfo(kind)
            # 64 bits: the products above are Python's; those of `rescale_into` would overflow.
            if candidate.min <= ends[0] and ends[1] <= candidate.max and bits <= 32:
                return np.dtype(kind)
    return np.dtype(np.float32 if bits <= 16 else np.float64)


def grid_from_columns(columns: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return spacing and direction from a (3, 3) matrix; column a is the world step between neighbours along axis a."""
    steps = np.array(columns, dtype=np.float64)
    if not np.isfinite(steps).all():
        raise FileFault(f"the directions of its axes must be finite, got {steps.T.tolist()}")
    # Scaled first, so that the squares of a step of 1e-200 do not vanish.
    largest = np.abs(steps).max(axis=0)
    for axis, length in zip("xyz", largest, strict=True):
        if length == 0:
            rule = "spacing must be positive and direction not singular"
            raise FileFault(f"{rule}; the step along axis {axis} is 0, 0, 0")
    spacing = largest * np.linalg.norm(steps / largest, axis=0)
    return spacing, steps / spacing + 0.0  # + 0.0: no -0 in what is printed


def by(sizes: Sequence[int]) -> str:
    """Return sizes in words: "4 x 5 x 6"."""
    return " x ".join(str(size) for size in sizes)


def in_bytes(count: float) -> str:
    """Return a number of bytes in words: "54000 bytes", "3.2 GiB"."""
    if count < 2**20:
        return f"{int(count)} bytes"
    power = min((int(count).bit_length() - 1) // 10, 5)
    return f"{count / 1024**power:.3g} {' KMGTP'[power]}iB"
