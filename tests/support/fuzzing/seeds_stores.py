"""Sound HDF5 and Imaris files, as seeds for `fuzz.py`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from support.fuzzing.seeds import STEPS, VALUES, Seed, of
from support.stores import write_imaris


def seeds() -> Iterator[Seed]:
    """Files of h5py; what reads Zarr has threads, which are not there in the processes that `fuzz.py` forks."""
    yield of("hdf5", "v.h5", _hdf5)
    yield of("imaris", "v.ims", lambda path: write_imaris(path, STEPS[:1]))


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.create_dataset("volume", data=VALUES, chunks=(2, 2, 2), compression="gzip")
