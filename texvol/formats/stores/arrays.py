"""Arrays in memory, mapped, or computed when they are asked for, as volumes that are read part by part."""

from __future__ import annotations

import mmap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.formats.readers.samples import Choice, FileFault
from texvol.formats.stores.coordinates import grid_of, letters_by_name, names_of
from texvol.formats.stores.placing import layout_of, letters_of
from texvol.formats.stores.sources import ChunkedSource, Layout, Reading, check_sizes, sample_type
from texvol.scene.large_volume import LargeVolume, Level
from texvol.util.errors import InputError

_CHUNK = 64  # samples along an axis, where the array names no chunks


class _Mapped(NamedTuple):
    """A mapped array as it is sent to another process."""

    path: str
    dtype: np.dtype
    offset: int
    shape: tuple[int, ...]

    def opened(self) -> NDArray:
        return np.memmap(self.path, self.dtype, "r", self.offset, self.shape)


@dataclass(eq=False)
class ArraySource(ChunkedSource):
    """Samples of anything that has a shape and a type, and returns parts by slices."""

    array: Any
    _read: int = 0

    def __getstate__(self) -> dict[str, Any]:
        state, array = super().__getstate__(), self.array
        if isinstance(array, np.memmap) and array.filename and isinstance(array.base, mmap.mmap):
            # Its samples stay in the file.
            state["array"] = _Mapped(str(array.filename), array.dtype, array.offset, array.shape)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        mapped = state["array"]
        super().__setstate__(state | ({"array": mapped.opened()} if isinstance(mapped, _Mapped) else {}))

    @property
    def bytes_read(self) -> int:
        """Bytes of the samples that have been asked for so far."""
        return self._read

    def fetch(self, index: tuple[int | slice, ...]) -> NDArray:
        """Return a part of the array; raise FileFault if it cannot be computed."""
        try:
            part = np.asarray(self.array[index])
        except MemoryError:
            raise
        except Exception as error:  # a graph of tasks, or a library's array, raises anything
            raise FileFault(" ".join(str(error).split()) or type(error).__name__) from None
        with self._lock:
            self._read += part.nbytes
        return part.astype(part.dtype.newbyteorder("="), copy=False)


def open_array(
    array: Any,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    direction: ArrayLike | None = None,
    *,
    chunk_shape: Sequence[int] | None = None,
    channel: int | None = None,
    time: int | None = None,
    missing: float | Sequence[float] = (),
    memory: int | None = None,
    unit: str | None = None,
    value_unit: str = "",
    name: str = "array",
    labels: bool = False,
    blocks: bool = False,
) -> LargeVolume:
    """Return a volume of an array whose samples are read part by part, when they are asked for.

    Parameters
    ----------
    array
        Has `shape`, `dtype`, and parts by slices: numpy's arrays and memory maps, those of dask, Zarr and h5py. The
        last three axes are z, y, x. Those of an xarray.DataArray are known by their names (z, y, x, c, t, in any
        order), and spacing, origin and unit by its coordinates.
    spacing, origin : (x, y, z), optional
        As of `Volume`; those of the coordinates, or 1 and 0, unless told.
    direction : array of shape (3, 3), optional
        As of `Volume`; coordinates that descend turn their axis round unless told.
    chunk_shape : (z, y, x), optional
        Samples that are read at once; the chunks of the array unless told, or 64 along each axis.
    channel, time : int, optional
        Number along a further axis.
    missing : number or sequence of numbers
        Samples of these values are missing.
    memory : int, optional
        Bytes of samples that may be held in memory; half of what is free by default.
    unit, value_unit, name, labels, blocks
        As of `Volume`.

    Raises
    ------
    InputError
        If it is no array of real numbers with three axes of space, or its coordinates are uneven.
    """
    from texvol.formats.readers.missing import marks_of

    for each in ("shape", "dtype", "__getitem__"):
        if not hasattr(array, each):
            raise InputError(f"array must have {each}, got {type(array).__name__}")
    try:
        names = names_of(array)
        shape = tuple(int(each) for each in array.shape)
        check_sizes(shape)
        named = [each for each in names if each is not None]
        letters = letters_by_name(array, named) if named else letters_of(names)
        layout = layout_of(letters, shape, Choice(channel=channel, time=time), [each or "-" for each in names])
        grid = grid_of(array, names, layout, told=spacing is not None)
        source = ArraySource(
            layout, sample_type(np.dtype(array.dtype), str(array.dtype)),
            _chunk(array, shape, layout, chunk_shape), "array", Reading(name, marks_of(missing)), _bare(array),
        )  # fmt: skip
    except FileFault as fault:
        raise InputError(f"{name}: {fault}") from None
    return LargeVolume(
        (Level(source),),
        grid["spacing"] if spacing is None else spacing,
        grid["origin"] if origin is None else origin,
        grid["direction"] if direction is None else direction,
        unit=grid["unit"] if unit is None else unit,
        memory=memory, value_unit=value_unit, name=name, labels=labels, blocks=blocks,
    )  # fmt: skip


def _bare(array: Any) -> Any:
    """Return what holds the samples of an xarray.DataArray in memory or in dask, or the array itself."""
    if not hasattr(array, "coords"):
        return array
    # `variable` returns parts without making new coordinates of each.
    return array.variable if hasattr(array, "variable") else array


def _chunk(array: Any, shape: tuple[int, ...], layout: Layout, told: Sequence[int] | None) -> tuple[int, ...]:
    """Return the chunk along the array's own axes."""
    own = getattr(array, "chunksize", None) or getattr(array, "chunks", None)  # dask's, or those of Zarr and h5py
    if own is not None and len(own) == len(shape) and all(isinstance(each, tuple) for each in own):
        own = tuple(max(each) for each in own)
    if not (isinstance(own, tuple) and len(own) == len(shape) and all(isinstance(each, int) for each in own)):
        own = tuple(min(each, _CHUNK) for each in shape)
    chunk = [int(each) for each in own]
    if told is not None:
        if len(told) != 3 or min(told) < 1:
            raise FileFault(f"chunk_shape must be three positive numbers z, y, x, got {tuple(told)}")
        for axis, each in zip(layout.order, told, strict=True):
            if axis is not None:
                chunk[axis] = int(each)
    return tuple(chunk)
