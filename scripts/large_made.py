"""A made volume of any size with structure at all scales: computed when a part is asked for, and written as OME-Zarr.

A few waves as long as the box and shorter, down to 256 samples, decide where there is matter; a periodic block of 256³
samples, sheets at five scales and noise, gives it its structure. Some half of the chunks is air, where every sample
is 0.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from texvol.formats.stores.arrays import open_array
from texvol.formats.stores.writing.convert import convert
from texvol.util.terminal import status_line

Numbers = NDArray[np.float32]
_PERIOD = 256  # samples of the block that is repeated
_WAVES = 5  # of each length
_SHEETS = (128, 64, 32, 16, 8)  # samples from one to the next
_MATTER, _STRUCTURE, _AIR = 0.7, 0.15, 0.5  # weights of waves and block, and what is taken from their sum


class MadeVolume:
    """Array (z, y, x) of uint8 that is computed part by part; the same for the same number of samples."""

    def __init__(self, samples: int) -> None:
        self.shape = (samples, samples, samples)
        self.dtype = np.dtype(np.uint8)

    def __getitem__(self, index: tuple[slice, slice, slice]) -> NDArray[np.uint8]:
        """Return the samples of a box."""
        places = [np.arange(part.start, part.stop) for part in index]
        values = self._matter(places)
        values += self._block[np.ix_(*(each % _PERIOD for each in places))]
        values -= np.float32(_AIR)
        values *= np.float32(255)
        return np.clip(values, 0, 255, out=values).astype(np.uint8)

    def _matter(self, places: list[NDArray[np.intp]]) -> Numbers:
        """Return the sum of the waves, each a product of three cosines."""
        along = []
        for axis, where in enumerate(places):
            frequencies, phases = self._waves[axis]
            along.append(np.cos(frequencies[:, np.newaxis] * where + phases[:, np.newaxis]).astype(np.float32))
        z, y, x = along
        across = (z[:, :, np.newaxis] * y[:, np.newaxis]).reshape(len(z), -1) * self._amplitudes[:, np.newaxis]
        sums: Numbers = (across.T @ x).reshape([len(each) for each in places])
        return sums

    @cached_property
    def _lengths(self) -> NDArray[np.float64]:
        """Lengths of all waves in samples: that of the box, half of it and so on."""
        count = max(int(np.log2(self.shape[0] / _PERIOD)), 0) + 1
        return np.repeat(self.shape[0] / 2.0 ** np.arange(count), _WAVES)

    @cached_property
    def _waves(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Frequencies and phases along each axis."""
        random = np.random.default_rng(self.shape[0])
        count = len(self._lengths)
        return [
            (2 * np.pi * random.uniform(0.4, 1.6, count) / self._lengths, random.uniform(0, 2 * np.pi, count))
            for _ in range(3)
        ]

    @cached_property
    def _amplitudes(self) -> Numbers:
        """Weights of the waves: shorter ones count less."""
        weights = np.sqrt(self._lengths / self._lengths[0])
        return (_MATTER * 2.8 * weights / np.linalg.norm(weights)).astype(np.float32)

    @cached_property
    def _block(self) -> Numbers:
        """Gyroid sheets at several scales and noise, of mean 0, shape (256, 256, 256)."""
        axis = 2 * np.pi * np.arange(_PERIOD, dtype=np.float32)
        block = np.zeros((_PERIOD,) * 3, np.float32)
        for apart in _SHEETS:
            s, c = np.sin(axis / apart), np.cos(axis / apart)
            sheets = np.einsum("z,y->zy", s, c)[..., np.newaxis] + np.einsum("y,x->yx", s, c)[np.newaxis]
            block += np.float32((apart / _SHEETS[0]) ** 0.5) * (sheets + np.einsum("z,x->zx", c, s)[:, np.newaxis])
        block += np.random.default_rng(1).standard_normal(block.shape, np.float32) * np.float32(0.1)
        return block * np.float32(_STRUCTURE / block.std())


def made_store(folder: Path, samples: int) -> Path:
    """Return the store of the made volume in a folder; it is written if it is not there."""
    store = folder / f"made-{samples}.ome.zarr"
    if (store / "zarr.json").exists() and '"ome"' in (store / "zarr.json").read_text():
        return store
    start = time.perf_counter()
    with status_line() as show:
        convert(open_array(MadeVolume(samples), name=store.name), store, tell=_teller(show, start, samples))
    print(f"{store.name} was made in {time.perf_counter() - start:.0f} s.", flush=True)
    return store


def made_npy(folder: Path, samples: int) -> Path:
    """Return the .npy file of the made volume in a folder; it is written if it is not there."""
    path = folder / f"made-{samples}.npy"
    if not path.exists():
        np.save(path, MadeVolume(samples)[slice(0, samples), slice(0, samples), slice(0, samples)])
    return path


def _teller(show: Callable[[str], None], start: float, samples: int) -> Callable[[float], None]:
    def tell(fraction: float) -> None:
        left = (time.perf_counter() - start) * (1 / fraction - 1)
        show(f"{samples}³: {100 * fraction:.0f} % written, {left:.0f} s left")

    return tell
