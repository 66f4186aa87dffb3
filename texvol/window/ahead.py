"""Reading of time steps on a thread: the wanted step first, and the next steps as far as a memory bound allows.

A Track says how the steps of one volume of the scene are read and where they lie. One thread reads all tracks, since
libraries such as that of netCDF serve one thread at a time; it keeps the files open, and what several steps share.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers import ARGUMENTS, TimeSeries
from texvol.scene.volume import Volume
from texvol.util.errors import TexvolError
from texvol.util.memory import free_memory
from texvol.window.stand_in import stand_in

_OF_FREE = 1 / 8  # of the free memory that steps may take
_MOST_BYTES = 1 << 30
_MOST_STEPS = 64
_PREPARED = 2  # steps that are copied for painting processes: the wanted one, and the next


@dataclass(frozen=True)
class Track:
    """Time series that a volume of the scene is a step of, with the volume's place in the world.

    Attributes
    ----------
    key : str
        The same for all steps of one volume.
    like : Volume
        One of the steps, whose place and kind the others have.
    """

    key: str
    like: Volume = field(compare=False)

    @classmethod
    def of(cls, volume: Volume) -> Track | None:
        """Return the track of a volume; None if no time step was chosen when it was read."""
        source = volume.source
        if source.get("time") is None or "absolute" not in source:
            return None
        parts = {name: each for name, each in source.items() if name not in ("time", "path")}
        return cls(json.dumps([parts, volume.space, volume.unit], sort_keys=True, default=str), volume)

    @property
    def step(self) -> int:
        """Number of the step that `like` is."""
        return int(self.like.source["time"])

    def series(self) -> TimeSeries:
        """Open the series.

        Raises
        ------
        InputError, MissingExtraError
            If its file can't be read.
        """
        source = self.like.source
        told = {name: source[name] for name in ARGUMENTS if source.get(name) is not None and name != "time"}
        return TimeSeries(source["absolute"], **told)

    def placed(self, volume: Volume) -> Volume:
        """Return a step, as it is read, in the place and the world of the others."""
        like = self.like
        if "transform" in like.source:
            volume = volume.moved(like.source["transform"])
        if volume.space != like.space or volume.unit != like.unit:
            volume = volume.with_unit(like.unit)
            volume.space = like.space
        return volume


Steps = dict[str, Volume]  # volumes of one step, by the keys of their tracks


class Ahead:
    """Steps that have been read, and the thread that reads them.

    Parameters
    ----------
    wake : callable
        Called on the thread after each step.
    most_bytes : int, optional
        Memory that steps may take, beside the wanted one.
    prepare : callable, optional
        Called on the thread with the arrays of the wanted step and the next one, before these steps are returned. It
        copies them to where painting processes read them, which takes too long for the window's own thread.
    """

    def __init__(
        self,
        wake: Callable[[], None],
        most_bytes: int | None = None,
        prepare: Callable[[Sequence[NDArray]], None] | None = None,
    ) -> None:
        self._wake, self._prepare = wake, prepare
        self._prepared: dict[tuple[str, int], Volume] = {}
        self._most = min(int(free_memory() * _OF_FREE), _MOST_BYTES) if most_bytes is None else most_bytes
        self._changed = threading.Condition()
        self._tracks: dict[str, Track] = {}
        self._order: tuple[int, ...] = ()
        self._kept: dict[tuple[str, int], Volume] = {}
        self._bad: set[tuple[str, int]] = set()
        self._closed = False
        self.lengths: dict[str, int] = {}
        self.times: dict[str, tuple[NDArray[np.float64], str]] = {}
        self.faults: list[str] = []
        threading.Thread(target=self._run, daemon=True, name="texvol time steps").start()

    def ask(self, tracks: Sequence[Track], order: Sequence[int]) -> None:
        """Have steps read, in this order; other steps and tracks are forgotten."""
        with self._changed:
            self._tracks = {each.key: each for each in tracks}
            self._order = tuple(order)[:_MOST_STEPS]
            for each in tracks:  # which has been read
                self._kept.setdefault((each.key, each.step), each.like)
            self._forget()
            self._changed.notify()

    def steps(self, keys: Sequence[str], number: int) -> Steps | None:
        """Return the volumes of a step, or None if one of them has not been read and prepared yet."""
        kept = self._kept if self._prepare is None else self._prepared
        found = {key: kept.get((key, number)) for key in keys}
        return None if None in found.values() else {key: each for key, each in found.items() if each is not None}

    def is_bad(self, keys: Sequence[str], number: int) -> bool:
        """True if a step can't be read."""
        return any((key, number) in self._bad for key in keys)

    @property
    def nbytes(self) -> int:
        """Bytes of the steps that are kept."""
        return sum(map(_bytes_of, list(self._kept.values())))

    def close(self) -> None:
        """End the thread and forget all steps."""
        with self._changed:
            self._closed = True
            self._kept, self._prepared = {}, {}
            self._changed.notify()

    @property
    def _near(self) -> tuple[int, ...]:
        """Steps that are asked for, as far as there is memory for them: the first one always."""
        size = sum(_bytes_of(each.like) for each in self._tracks.values())
        return self._order[: 1 + self._most // max(size, 1)]

    def _forget(self) -> None:
        """Keep only steps that are asked for."""
        near = set(self._near)
        self._kept = {key: each for key, each in self._kept.items() if key[0] in self._tracks and key[1] in near}

    def _next(self) -> tuple[Track, int] | None:
        """Return the next step to be read, or None if none is asked for or there is no memory for another one."""
        for track in self._tracks.values():
            if track.key not in self.lengths:
                return track, -1
        for number in self._near:
            for key, track in self._tracks.items():
                known = (key, number) in self._kept or (key, number) in self._bad
                if not known and number < self.lengths[key]:
                    return track, number
        return None

    def _run(self) -> None:
        opened: dict[str, TimeSeries] = {}
        while True:
            with self._changed:
                while not self._closed and self._next() is None and self._to_prepare() is None:
                    self._changed.wait()
                if self._closed:
                    break
                found, soon = self._next(), self._to_prepare()
                for key in opened.keys() - self._tracks.keys():
                    opened.pop(key).close()
            if soon is not None:
                self._make_ready(soon)
            elif found is not None:
                self._read(opened, *found)
            self._wake()
        if self._prepare is not None:
            self._prepare(())
        for series in opened.values():
            series.close()

    def _to_prepare(self) -> dict[tuple[str, int], Volume] | None:
        """Return the volumes of the next steps as far as they have been read; None if they have been prepared."""
        if self._prepare is None:
            return None
        soon = {key: each for key, each in self._kept.items() if key[1] in self._order[:_PREPARED]}
        return None if soon == self._prepared else soon

    def _make_ready(self, soon: dict[tuple[str, int], Volume]) -> None:
        assert self._prepare is not None
        arrays = [array for each in soon.values() for array in (each.values, each.colors) if array is not None]
        with suppress(OSError):  # without memory for the copy, sending the step fails again, and the window says so
            self._prepare(arrays)
        with self._changed:
            if not self._closed:
                self._prepared = soon

    def _read(self, opened: dict[str, TimeSeries], track: Track, number: int) -> None:
        """Open a series, if `number` is negative, or read one of its steps; what fails is not tried again."""
        try:
            if number < 0:
                opened[track.key] = series = track.series()
                self.lengths[track.key] = len(series)
                return
            if track.key not in opened:
                opened[track.key] = track.series()
            series = opened[track.key]
            volume = stand_in(track.placed(series[number]))
            if track.key not in self.times and series.times is not None:
                self.times[track.key] = series.times, series.time_unit
        except Exception as error:  # a reader may raise anything on a damaged file; the window stays open
            text = " ".join(str(error).split()) or type(error).__name__
            self.faults.append(text if isinstance(error, TexvolError) else f"{track.like.name}: {text}")
            self._bad.add((track.key, number))
            self.lengths.setdefault(track.key, 1)
            return
        with self._changed:
            if not self._closed and track.key in self._tracks:
                self._kept[track.key, number] = volume
                self._forget()


def _bytes_of(volume: Volume) -> int:
    return int(volume.values.nbytes + (0 if volume.colors is None else volume.colors.nbytes))


def replacements(tracks: Mapping[str, Sequence[Volume]], found: Steps) -> dict[Volume, Volume]:
    """Return the new volume for each volume of the scene."""
    return {old: found[key] for key, several in tracks.items() for old in several if found[key] is not old}
