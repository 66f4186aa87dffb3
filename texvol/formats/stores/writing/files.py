"""Recordings of files: all time steps and channels that texvol reads of a file, and the labels of its image."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from texvol.formats.readers.detection import STORES, format_of, located
from texvol.formats.readers.loading import axis_length, checked, named_faults, read, volume_of
from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.formats.readers.samples import Choice, FileFault, Samples, TimeSteps
from texvol.formats.stores.access import Store, joined
from texvol.formats.stores.images import image_of, label_names
from texvol.formats.stores.ome import Image, ome_attributes
from texvol.formats.stores.writing.recording import Part, Recording, stamp_of
from texvol.scene.channel import Channel
from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.locations import absolute, public
from texvol.util.memory import free_memory

# Formats that mark missing samples, which turn whole numbers into floats in the time steps that have some.
_MARKING = ("NRRD", "DICOM", "TIFF", "VTI", "VTR", "VTS", "netCDF")
_MOST_PARTS = 10**6  # time steps times channels
_COLORS = (("red", (1.0, 0.0, 0.0)), ("green", (0.0, 1.0, 0.0)), ("blue", (0.0, 0.0, 1.0)), ("opacity", (1.0,) * 3))


class Opened(NamedTuple):
    """Image of a file, and the labels that belong to it by their names."""

    image: Recording
    labels: dict[str, Recording]


def open_file(path: str, output: str = "", *, every_step: bool = False, **options: Any) -> Opened:
    """Return all that a file holds of what the options do not choose.

    Parameters
    ----------
    path : str
    output : str
        Folder that will be written, which may lie in a folder that is read.
    every_step : bool
        True if an axis without a name is time; else it is one of channels, unless `time` is chosen.
    options
        Those of `texvol.formats.readers.load`.

    Raises
    ------
    InputError, MissingExtraError
        As `load`.
    """
    choice = checked(path, Choice(**options))
    with named_faults(path, "a volume", "formats"):
        if choice.color:
            raise FileFault("a store holds no colours: leave --color out, and red, green and blue become channels")
        path, choice = located(path, choice)
        kind = format_of(path, choice)
    one = _File(path, kind, choice, output)
    image = one.recording(every_step)
    return Opened(image, {name: each.recording(every_step) for name, each in one.labels()})


class _Part(NamedTuple):
    """Volume of a time step and channel, and what its file says of all of them."""

    volume: Volume
    samples: Samples


class _File:
    """Image of a file, by the options that choose it."""

    def __init__(self, path: str, kind: str, choice: Choice, output: str, title: str = "") -> None:
        self.path, self.kind, self.output = path, kind, output
        self.title = title or os.path.basename(public(path).rstrip("/")).split(".")[0]
        self.choice = choice._replace(kept={}) if kind in STORES else choice
        self._mapped = _mapped(path, choice) if kind == "NPY" else None
        self._has_channels = False
        self._own_spacing: Any = (1.0, 1.0, 1.0)

    def recording(self, every_step: bool) -> Recording:
        """Return its time steps and channels."""
        steps, channels = self._lengths(every_step)
        self._has_channels = channels > 0
        if max(steps, 1) * max(channels, 1) > _MOST_PARTS:
            raise InputError(
                f"{public(self.path)}: must have at most {_MOST_PARTS} time steps and channels in all, got {steps} and "
                f"{channels}: choose by --time and --channel"
            )
        letters = "t" * (steps > 1) + "c" * (channels > 1)
        first = self._read((0,) * len(letters), letters)
        self._own_spacing = first.samples.spacing
        described = self._described(first, channels)
        if described and channels <= 1:
            letters += "c"
        is_kept = isinstance(first.volume, LargeVolume)
        self._keep_unpacked(first.volume, max(steps, 1) * max(channels, 1))
        return Recording(
            public(self.path),
            lambda part: self._read(part, letters).volume,
            letters,
            tuple(max(each, 1) for each, letter in ((steps, "t"), (channels, "c")) if letter in letters),
            described,
            tuple(first.samples.times or ()) if "t" in letters else (),
            first.samples.time_unit,
            self._identity(every_step),
            self._label_attributes(),
            types_differ=not is_kept and bool(self.choice.missing or self.kind in _MARKING),
            title=self.title,
            held=((0,) * len(letters), first.volume),
        )

    def labels(self) -> Iterator[tuple[str, _File]]:
        """Yield the labels that belong to the image of an OME-Zarr store, of the chosen time step if they have time."""
        own = self._image()
        if own is None or own[1].is_label:
            return
        store, image = own
        for name in label_names(store, image.group):
            key = joined(joined(image.group, "labels"), name)
            told = Choice(image=key, labels=True, memory=self.choice.memory, kept={})
            with named_faults(self.path, "OME-Zarr", "zarr"):
                levels = len(image_of(store, key)[0].datasets)
            if self.choice.time is not None and axis_length(self.path, told._replace(channel=0), "T"):
                told = told._replace(time=self.choice.time)
            if self.choice.level is not None:
                told = told._replace(level=min(self.choice.level, levels - 1))
            if self.choice.spacing is not None:
                scale = np.array(self.choice.spacing) / self._own_spacing
                theirs = read(self.path, told._replace(channel=None, time=told.time or 0)).spacing
                told = told._replace(spacing=(scale * theirs).tolist())
            yield name, _File(self.path, self.kind, told, self.output, name.rpartition("/")[2])

    def _lengths(self, every_step: bool) -> tuple[int, int]:
        """Return the numbers of time steps and channels that are not chosen, 0 without such an axis."""
        told = self.choice
        channels = 0
        if told.channel is None:
            channels = axis_length(self.path, told._replace(time=told.time or 0), "C")
        steps = axis_length(self.path, told._replace(channel=0) if channels else told, "T")
        if channels and not steps and (every_step or told.time is not None):
            # An axis without a name is what the options speak of.
            with suppress(InputError):
                steps = axis_length(self.path, told, "T")
                channels = 0 if steps else channels
        return (steps if told.time is None else 0), channels

    def _read(self, part: Part, letters: Sequence[str]) -> _Part:
        number = dict(zip(letters, part, strict=True))
        channel = number.get("c", 0) if self._has_channels else self.choice.channel
        choice = self.choice._replace(time=number.get("t", self.choice.time), channel=channel)
        if self._mapped is not None:
            return _Part(_volume_of_array(self._mapped, choice, self.path), Samples(np.empty(0)))
        samples = read(self.path, choice)
        volume = volume_of(self.path, samples, choice)
        return _Part(volume, samples._replace(values=np.empty(0)))

    def _described(self, first: _Part, channels: int) -> tuple[Channel, ...]:
        """Return the descriptions of all channels that are read; none if they say nothing."""
        samples = first.samples
        if self._is_colored():
            kind = first.volume.dtype
            window = (0.0, 1.0 if kind.kind == "f" else float(np.iinfo(kind).max))
            found = [Channel(at, *each, window) for at, each in enumerate(_COLORS[:channels])]
        elif self.choice.channel is not None and samples.channel is not None:
            found = [samples.channel._replace(number=0, active=True)]
        else:
            found = list(samples.channels)
        said = any(each != Channel(each.number) for each in found) and len(found) == max(channels, 1)
        return tuple(found) if said else ()

    def _is_colored(self) -> bool:
        """True if the file says that its components are colours."""
        if self.kind in STORES or self.choice.channel is not None:
            return False
        try:
            read(self.path, self.choice._replace(time=None, counting=True))
        except TimeSteps as told:
            return bool(told.args[1:] and told.args[1])
        except InputError:  # several axes could be time
            pass
        return False

    def _keep_unpacked(self, first: Volume, parts: int) -> None:
        """Have compressed samples unpacked once for all parts, if they fit into half of the memory."""
        room = free_memory() // 2 if self.choice.memory is None else self.choice.memory
        if self.kind not in STORES and parts > 1 and first.dtype.itemsize * np.prod(first.shape) * parts <= room / 2:
            self.choice = self.choice._replace(kept={})

    def _identity(self, every_step: bool) -> dict[str, Any]:
        """Return what is converted, in JSON types."""
        plain = Choice()._asdict()
        told = {name: each for name, each in self.choice._asdict().items() if each != plain[name]}
        for name in ("memory", "kept"):
            told.pop(name, None)
        place = absolute(self.path)
        stamp = stamp_of(place, self.output)
        found = {"file": public(place), "told": told, "every_step": every_step, "stamp": stamp}
        return dict(json.loads(json.dumps(found)))

    def _image(self) -> tuple[Store, Image] | None:
        """Return the image of an OME-Zarr store that is read; None of anything else."""
        if self.kind != "Zarr" or self.choice.variable is not None:
            return None
        with named_faults(self.path, "OME-Zarr", "zarr"):
            store = Store(self.path)
            return None if store.version("") else (store, image_of(store, self.choice.image)[0])

    def _label_attributes(self) -> dict[str, Any] | None:
        """Return what the store says of its labels: colours and properties."""
        own = self._image()
        if own is None:
            return None
        told = ome_attributes(own[0].attributes(own[1].group) or {}).get("image-label")
        try:
            json.dumps(told, allow_nan=False)
        except ValueError:  # Python reads NaN and Infinity, which JSON has not
            return None
        return dict(told) if isinstance(told, dict) else None


def _mapped(path: str, choice: Choice) -> Any:
    """Return the array of an .npy file, which stays on disk; None for what has to be read or refused otherwise."""
    if choice.channel == MAGNITUDE:
        return None
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError):
        return None
    return array if array.ndim >= 3 and array.dtype.kind in "iufb" else None


def _volume_of_array(array: Any, choice: Choice, path: str) -> Volume:
    from texvol.formats.stores.arrays import open_array

    return open_array(
        array, choice.spacing, channel=choice.channel, time=choice.time, missing=choice.missing,
        memory=choice.memory, name=path, labels=choice.labels, blocks=choice.blocks,
    )  # fmt: skip
