"""What readers share: samples and their grid, bounds on what a header may ask for, axes beyond three, rescaling."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

T = TypeVar("T")

# Compressed samples are unpacked where that makes them no more than so many times as large: deflate reaches 1032, LZW
# 1365, JPEG 2000 and LZMA some thousands where almost all samples are 0. So many bytes do no harm in any case.
_BEST_PACKING = 10000
_UNPACKED_ANYWAY = 2**26


class FileFault(Exception):
    """What is wrong with the file being read, without its name; `load` adds that."""


class TimeSteps(Exception):
    """How many time steps a file has, from a reader that was asked to count them and not to read: `Choice.counting`."""

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self.count = count


class Choice(NamedTuple):
    """What the user says about a file that the file does not: see `texvol.formats.readers.load`.

    With `counting` a reader ends with TimeSteps as soon as it knows them; in `kept` it may leave, under keys of its
    own, what the next step of the same file needs again.
    """

    shape: tuple[int, ...] | None = None
    dtype: str | None = None
    series: str | None = None
    channel: int | None = None
    time: int | None = None
    variable: str | None = None
    resolution: tuple[int, ...] | None = None
    labels: bool = False
    color: bool | None = None
    missing: tuple[int | float, ...] = ()
    counting: bool = False
    kept: dict[Any, Any] | None = None


class Samples(NamedTuple):
    """What a reader returns: values of shape (nz, ny, nx), not checked, and the grid as `Volume` describes it.

    `resampling`, `notes` and `colors` are those of `Volume`; `times` are those of all steps, in `time_unit`, where the
    file says.
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


def once(choice: Choice, key: Any, make: Callable[[], T]) -> T:
    """What `make` returns; for the steps of a series it is made with the first one, and kept under `key`."""
    if choice.kept is None:
        return make()
    if key not in choice.kept:
        choice.kept[key] = make()
    return choice.kept[key]


def check_size(sizes: Sequence[int], item_bytes: int) -> int:
    """Bytes of an array of these sizes, if there are any and the machine can hold them; FileFault otherwise."""
    sizes = [int(size) for size in sizes]
    if any(size < 1 for size in sizes):
        raise FileFault(f"every dimension must be positive, and the header says {by(sizes)}")
    needed = prod(sizes) * item_bytes
    available = available_memory()
    if needed > available:
        room = in_bytes(available)
        raise FileFault(f"{by(sizes)} samples need {in_bytes(needed)} of memory, and this machine has {room}")
    return needed


def check_unpacked(needed: int, packed: int) -> None:
    """FileFault if `needed` bytes are more than `packed` compressed ones hold, beside what is held in no time."""
    if needed > _UNPACKED_ANYWAY + _BEST_PACKING * packed:
        raise FileFault(
            f"holds {in_bytes(packed)}, and its header's dimensions need {in_bytes(needed)}: more than {_BEST_PACKING} "
            "times that is not unpacked"
        )


def available_memory() -> int:
    """Bytes of memory that the machine can still give, the limit of its control group included where there is one."""
    available = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            available = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
        with open("/sys/fs/cgroup/memory.max", encoding="ascii") as limit:
            available = min(available, int(limit.read()))
    except (OSError, ValueError, StopIteration):
        pass  # no such file, or "max": the machine's memory is the limit
    return available


def native(values: NDArray) -> NDArray:
    """`values`, which nobody else holds, in the machine's byte order; turned where they lie, without a second array."""
    if not values.dtype.isnative:
        values.byteswap(inplace=True)
    return values.view(values.dtype.newbyteorder("="))


def real_type(dtype: np.dtype) -> np.dtype:
    """`dtype`, if it is a real number of at most 64 bits; FileFault otherwise."""
    if dtype.kind == "c":
        raise FileFault(f"holds complex numbers ({dtype}), and a volume holds real ones")
    if dtype.kind not in "iufb" or dtype.itemsize > 8:
        raise FileFault(f"holds samples of type {dtype}, and a volume holds real numbers of at most 64 bits")
    return dtype


def pick(axes: str, sizes: Sequence[int], choice: Choice) -> tuple[int | slice, ...]:
    """Index that leaves the three axes of space, and that of colour where there is one.

    Parameters
    ----------
    axes : str
        A letter for each axis: "Z", "Y", "X", "C" for channel, "T" for time, "K" for colour, "?" for one that the file
        does not name, along which either option picks.
    sizes : sequence of int
        Samples along each.

    Raises
    ------
    FileFault
        If an axis of space is missing, an option is missing, out of range, or has no axis to pick along.
    TimeSteps
        If the steps are to be counted.
    """
    sizes = [int(size) for size in sizes]
    if choice.counting:
        raise TimeSteps(_steps(axes, sizes, choice))
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
            raise FileFault(f"has {len(sizes)} axes ({_listed(axes, sizes)}); choose one with {options} 0..{size - 1}")
        chosen = wanted.pop(names[0])
        if chosen is None or not 0 <= chosen < size:
            raise out_of_range(names[0], chosen, size)
        index.append(chosen)
    for name, chosen in wanted.items():
        if chosen:
            raise FileFault(f"{_OPTIONS[name]} {chosen}: the file has no {_NAMES[name]} axis ({_listed(axes, sizes)})")
    if [axis for axis in axes if axis in "ZYX"] != list("ZYX"):
        spatial = [size for axis, size in zip(axes, sizes, strict=True) if axis in "ZYX"]
        raise FileFault(f"is {len(spatial)}-D ({by(spatial[::-1])}), and a volume has 3 axes")
    return tuple(index)


def _steps(axes: str, sizes: Sequence[int], choice: Choice) -> int:
    """Samples along the axis of time, or along one without a name that no channel is chosen along."""
    steps = [size for axis, size in zip(axes, sizes, strict=True) if axis == "T"]
    unnamed = [size for axis, size in zip(axes, sizes, strict=True) if axis == "?" and size > 1]
    if not steps and choice.channel is None:
        steps = unnamed
    if len(steps) > 1:
        raise FileFault(f"has {len(steps)} axes that could be time ({_listed(axes, sizes)})")
    return steps[0] if steps else 1


def out_of_range(axis: str, chosen: int | None, size: int) -> FileFault:
    """What is wrong with a choice along "C" or "T" that there is not."""
    plural = "" if size == 1 else "s"
    return FileFault(f"{_OPTIONS[axis]} {chosen} is not in 0..{size - 1}: it has {size} {_COUNTED[axis]}{plural}")


_OPTIONS = {"C": "--channel", "T": "--time"}
_COUNTED = {"C": "channel", "T": "time step"}
_NAMES = {"C": "channel", "T": "time", "?": "unnamed", "Z": "z", "Y": "y", "X": "x", "K": "colour"}


def _listed(axes: str, sizes: Sequence[int]) -> str:
    return ", ".join(f"{_NAMES[axis]} {size}" for axis, size in zip(axes[::-1], sizes[::-1], strict=True))


def unnamed_axes(count: int) -> str:
    """Letters for `pick` of an array whose axes have no names, slowest first: the last three are space."""
    return ("?" * (count - 3) + "ZYX")[-count:] if count else ""


def rescaled(values: NDArray, slope: float, intercept: float, bits: int | None = None) -> NDArray:
    """slope · values + intercept, in the smallest type that holds it exactly, or to the digits that it has.

    With whole slope and intercept that is an integer type for what the stored type can hold, `bits` of it used. Else
    it is float32 for up to 16 bits (24 bits of mantissa hold the steps), float64 beyond; floats keep their own type.
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
    """Type of what `rescaled` returns."""
    if dtype.kind == "f":
        return np.dtype(np.float32 if dtype.itemsize <= 4 else np.float64)
    bits = dtype.itemsize * 8 if bits is None else bits
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if dtype.kind == "i" else (0, 2**bits - 1)
    if float(slope).is_integer() and float(intercept).is_integer():
        ends = sorted((low * int(slope) + int(intercept), high * int(slope) + int(intercept)))
        for kind in ("u1", "i1", "u2", "i2", "u4", "i4", "i8"):
            candidate = np.iinfo(kind)
            # 64 bits: the products above are Python's, those of `rescale_into` would overflow in between.
            if candidate.min <= ends[0] and ends[1] <= candidate.max and bits <= 32:
                return np.dtype(kind)
    return np.dtype(np.float32 if bits <= 16 else np.float64)


def grid_from_columns(columns: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spacing and direction from a (3, 3) matrix whose column a is the world step between neighbours along axis a."""
    steps = np.array(columns, dtype=np.float64)
    if not np.isfinite(steps).all():
        raise FileFault(f"the directions of its axes must be finite, and are {steps.T.tolist()}")
    # Scaled first, so that the squares of a step of 1e-200 do not vanish.
    largest = np.abs(steps).max(axis=0)
    for axis, length in zip("xyz", largest, strict=True):
        if length == 0:
            wanted = "spacing must be positive and direction not singular"
            raise FileFault(f"{wanted}; the step along axis {axis} is 0, 0, 0")
    spacing = largest * np.linalg.norm(steps / largest, axis=0)
    return spacing, steps / spacing + 0.0  # + 0.0: no -0 in what is printed


def by(sizes: Sequence[int]) -> str:
    """Sizes as people write them: "4 x 5 x 6"."""
    return " x ".join(str(size) for size in sizes)


def in_bytes(count: float) -> str:
    """A number of bytes as people write it: "54000 bytes", "3.2 GiB"."""
    if count < 2**20:
        return f"{int(count)} bytes"
    for unit in ("MiB", "GiB", "TiB", "PiB"):
        count /= 1024 if unit != "MiB" else 2**20
        if count < 1024:
            break
    return f"{count:.3g} {unit}"
