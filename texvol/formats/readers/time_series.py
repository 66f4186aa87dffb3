"""Time series: files of several time steps, opened once, with a Volume for each step on the same grid."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.loading import checked, read, volume_of
from texvol.formats.readers.samples import Choice, TimeSteps
from texvol.scene.volume import Volume
from texvol.util.errors import InputError


def time_steps(path: str | os.PathLike[str], **options: Any) -> int:
    """Return the number of time steps of a file; 1 without an axis of time.

    Parameters
    ----------
    path : str or path
    options
        Those of `texvol.formats.readers.load`; an unnamed axis is time unless `channel` is given.

    Raises
    ------
    InputError, MissingExtraError
        As `load`.
    """
    name = os.fspath(path)
    choice = checked(name, Choice(**options))
    try:
        read(name, choice._replace(time=None, counting=True))
    except TimeSteps as steps:
        return int(steps.args[0])
    return 1


class TimeSeries(Sequence[Volume]):
    """Time steps of a file, each read on access.

    Results that later steps need again are kept: unpacked samples of compressed files, an open netCDF file, and the
    location of a curvilinear grid's points. Of uncompressed samples only those of the step are read.

    Parameters
    ----------
    path : str or path
    options
        Those of `texvol.formats.readers.load`, except `time`.

    Raises
    ------
    InputError, MissingExtraError
        As `load`; also for a step that does not exist.
    """

    def __init__(self, path: str | os.PathLike[str], **options: Any) -> None:
        if options.get("time") is not None:
            raise InputError(f"{os.fspath(path)}: time must be None for a series, got {options['time']}")
        self.name = os.fspath(path)
        self._steps = time_steps(path, **options)
        self._choice = checked(self.name, Choice(**options))._replace(kept={})
        self._when: tuple[NDArray[np.float64] | None, str] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without kept results; a copy or another process opens the file again."""
        return {**vars(self), "_choice": self._choice._replace(kept={})}

    def __len__(self) -> int:
        return self._steps

    def __getitem__(self, step: Any) -> Any:
        """Return the volume of a step, from 0; negative steps count from the end, and a slice gives a list."""
        if isinstance(step, slice):
            return [self[number] for number in range(*step.indices(self._steps))]
        number = step + self._steps if step < 0 else step
        if not 0 <= number < self._steps:
            plural = "" if self._steps == 1 else "s"
            raise InputError(f"{self.name}: time step {step} does not exist: it has {self._steps} step{plural}, from 0")
        choice = self._choice._replace(time=int(number))
        samples = read(self.name, choice)
        if self._when is None:
            times = None if samples.times is None or len(samples.times) != self._steps else np.array(samples.times)
            self._when = times, samples.time_unit
        return volume_of(self.name, samples, choice)

    def __iter__(self) -> Iterator[Volume]:
        return (self[number] for number in range(self._steps))

    @property
    def times(self) -> NDArray[np.float64] | None:
        """Times of the steps in `time_unit`, or None if the file has none."""
        return self._known_when()[0]

    @property
    def time_unit(self) -> str:
        """Unit of `times`: "s", or the file's own words, such as "hours since 2001-01-01"."""
        return self._known_when()[1]

    @cached_property
    def finite_range(self) -> tuple[float, float] | None:
        """Smallest and largest finite value of all steps, read one at a time; None if no value is finite."""
        known = [found for volume in self if (found := volume.finite_range) is not None]
        if not known:
            return None
        return min(low for low, _ in known), max(high for _, high in known)

    def close(self) -> None:
        """Release what is kept; a later access opens the file again."""
        kept = self._choice.kept or {}
        for each in kept.values():
            if hasattr(each, "close"):
                each.close()
        kept.clear()

    def __enter__(self) -> TimeSeries:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _known_when(self) -> tuple[NDArray[np.float64] | None, str]:
        if self._when is None:
            self[0]
        return self._when or (None, "")
