"""Recording: an image of several time steps and channels on one grid, of which a volume at a time is read."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.channel import Channel
from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Part = tuple[int, ...]  # numbers of a time step and a channel, each if there is such an axis
_SAME = 1e-4  # of a spacing, by which the grids of time steps may differ
_EVEN = 1e-6  # of a step, by which times may be uneven
_WORDS = {"t": "time step", "c": "channel"}


class Form(NamedTuple):
    """Grid and kind of a recording: all of a volume but its samples."""

    shape: tuple[int, int, int]
    dtype: np.dtype
    spacing: NDArray[np.float64]
    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    unit: str
    value_unit: str
    space: str
    labels: bool

    @classmethod
    def of(cls, volume: Volume) -> Form:
        """Return that of a volume."""
        return cls(*(getattr(volume, name) for name in cls._fields))


@dataclass
class Recording:
    """Image of several time steps and channels.

    Parameters
    ----------
    load : callable
        Returns the volume of a part.
    axes : str
        Letters of the axes before z, y, x: "t" for time, "c" for channels, "tc", or "" for a single volume.
    leading : tuple of int
        Number of samples along these axes.
    channels : tuple of Channel
        Descriptions of all channels; empty if nothing is known of any.
    times : tuple of float
        Times of all steps in `time_unit`; empty if they are not known.
    identity : mapping
        What is converted, in JSON types: a conversion of anything else cannot go on with it.
    label_attributes : mapping, optional
        Attributes "image-label" of a labels image.
    types_differ : bool
        True if the type of the samples may differ from part to part, so that all have to be looked at.
    """

    name: str
    load: Callable[[Part], Volume]
    axes: str = ""
    leading: Part = ()
    channels: tuple[Channel, ...] = ()
    times: tuple[float, ...] = ()
    time_unit: str = ""
    identity: Mapping[str, Any] = field(default_factory=dict)
    label_attributes: Mapping[str, Any] | None = None
    types_differ: bool = False
    title: str = ""
    held: tuple[Part, Volume] | None = None  # the last part that was read

    @classmethod
    def of(cls, volume: Volume) -> Recording:
        """Return the recording that is a single volume, with the description of its channel if it is one of several."""
        told = {key: value for key, value in volume.source.items() if key not in ("path", "memory")}
        place = told.get("absolute")
        stamp = stamp_of(place) if isinstance(place, str) else []
        channel = volume.channel if isinstance(volume, LargeVolume) else None
        described = () if channel is None else (channel._replace(number=0, active=True),)
        axes = {"axes": "c", "leading": (1,), "channels": described} if described else {}
        return cls(volume.name, lambda part: volume, **axes, identity={"source": told, "stamp": stamp})  # type: ignore[arg-type]

    @cached_property
    def form(self) -> Form:
        """Grid and kind of the first part, which those of all have to be."""
        return Form.of(self._loaded((0,) * len(self.leading)))

    @cached_property
    def dtype(self) -> np.dtype:
        """Type that holds the samples of all parts."""
        found = self.form.dtype
        if self.types_differ and found.kind in "iu":
            for part in self.parts():
                found = np.promote_types(found, self._loaded(part).dtype)
        return found

    @property
    def count(self) -> int:
        """Number of parts."""
        return int(np.prod(self.leading, dtype=np.int64))

    def parts(self) -> Iterator[Part]:
        """Yield all parts, channels fastest."""
        return product(*map(range, self.leading))

    def volume(self, part: Part) -> Volume:
        """Return the volume of a part; only the last one is held in memory.

        Raises
        ------
        InputError
            If it cannot be read, or has another grid or type than the first.
        """
        found = self._loaded(part)
        said = self._differs(found)
        if said:
            raise InputError(f"{self.name}: {self.named(part)} {said}; {self._remedy(part)}")
        return found

    def named(self, part: Part) -> str:
        """Return a part in words, as a message names it."""
        words = (f"{_WORDS[axis]} {number}" for axis, number in zip(self.axes, part, strict=True))
        return ", ".join(words) or "its volume"

    def even_times(self) -> tuple[float, float] | None:
        """Return the first time and the step between times; None where they are not known, or not even."""
        if len(self.times) < 2:
            return None
        times = np.array(self.times, np.float64)
        steps = np.diff(times)
        mean = (times[-1] - times[0]) / len(steps)
        if not np.isfinite(times).all() or mean <= 0 or np.abs(steps - mean).max() > _EVEN * mean:
            return None
        return float(times[0]), float(mean)

    def _loaded(self, part: Part) -> Volume:
        if self.held is None or self.held[0] != part:
            self.held = None  # before the next one takes memory
            self.held = part, self.load(part)
        return self.held[1]

    def _differs(self, volume: Volume) -> str:
        """Return in words how the grid or the type of a volume differs from that of the first; "" if it does not."""
        first = self.form
        if volume.shape != first.shape:
            return f"has {_by(volume.shape)} samples, and the first has {_by(first.shape)}"
        near = _SAME * float(first.spacing.min())
        for word in ("spacing", "origin", "direction"):
            if not np.allclose(getattr(volume, word), getattr(first, word), rtol=_SAME, atol=near):
                return f"has another {word} than the first"
        if np.promote_types(volume.dtype, self.dtype) != self.dtype:
            return f"has samples of type {volume.dtype}, and those before of {self.dtype}"
        return ""

    def _remedy(self, part: Part) -> str:
        options = {"t": "--time", "c": "--channel"}
        listed = " ".join(f"{options[axis]} {number}" for axis, number in zip(self.axes, part, strict=True))
        return f"all of a store are alike: convert it alone by {listed}"


def stamp_of(place: str, leaving: str = "") -> list[Any]:
    """Return what changes when a file does, or anything in a folder but `leaving`; empty of what is on a server."""
    if os.path.isfile(place):
        status = os.stat(place)
        return [status.st_size, status.st_mtime]
    if not os.path.isdir(place):
        return []
    seen = hashlib.blake2b(digest_size=16)
    apart = os.path.abspath(leaving) if leaving else None
    for folder, inner, names in os.walk(place):
        inner[:] = sorted(each for each in inner if os.path.abspath(os.path.join(folder, each)) != apart)
        for name in sorted(names):
            path = os.path.join(folder, name)
            try:
                status = os.stat(path)
            except OSError:  # a link to nothing
                continue
            told = f"{os.path.relpath(path, place)}\0{status.st_size}\0{status.st_mtime_ns}\n"
            seen.update(told.encode(errors="surrogateescape"))
    return [seen.hexdigest()]


def _by(shape: Sequence[int]) -> str:
    return " x ".join(map(str, shape[::-1]))
