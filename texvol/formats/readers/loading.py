"""Loading of a file into a Volume by the reader of its format."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Any

from texvol.formats.readers.detection import format_of
from texvol.formats.readers.faults import named_faults
from texvol.formats.readers.missing import without_chosen
from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.scene.volume import Volume

# Arguments of `texvol.formats.readers.load` that a volume's source keeps.
ARGUMENTS = (
    *("shape", "dtype", "series", "channel", "time", "variable", "resolution", "spacing", "labels", "color"),
    "missing",
)

_WITHOUT_LIBRARY = ("NPY", "raw")  # need no library that could print
_RESAMPLED = ("netCDF", "VTR", "VTS")  # mark missing samples themselves, before they interpolate


def read(name: str, choice: Choice) -> Samples:
    """Return the samples of the file `name`.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.formats.readers.load`.
    TimeSteps
        If `choice.counting`, and the format may have several steps.
    """
    with named_faults(name, "a volume", "formats"):
        _check(choice)
        kind = format_of(name, choice)
    with named_faults(name, kind, "formats"):
        return _read(kind, name, choice)


def _check(choice: Choice) -> None:
    """Raise FileFault if options contradict each other."""
    if choice.color and choice.labels:
        raise FileFault("samples can't be both labels and colours: give --labels or --color")
    if choice.color and choice.channel is not None:
        raise FileFault("a single channel has no colour: give --channel or --color")
    if choice.missing and choice.labels:
        raise FileFault("--missing is not for labels: --label-look LABEL=0 hides a label")


def volume_of(name: str, samples: Samples, choice: Choice, spacing: Sequence[float] | None) -> Volume:
    """Return the volume of the samples of the file `name`; `spacing` overrides the file's."""
    return Volume(
        samples.values,
        samples.spacing if spacing is None else spacing,
        samples.origin,
        samples.direction,
        unit=samples.unit,
        value_unit=samples.value_unit,
        space=samples.space,
        name=name,
        source=_source(name, choice, spacing),
        resampling=samples.resampling,
        notes=samples.notes,
        labels=choice.labels,
        colors=samples.colors,
    )


def _source(path: str, choice: Choice, spacing: Sequence[float] | None) -> dict[str, Any]:
    """Return the arguments with which the volume is read again."""
    told = {key: getattr(choice, key) for key in ARGUMENTS if key != "spacing"}
    told["labels"] = choice.labels or None
    told["missing"] = list(choice.missing) or None
    told["spacing"] = None if spacing is None else [float(number) for number in spacing]
    position = {"path": path, "absolute": os.path.abspath(path)}
    return position | {name: told[name] for name in ARGUMENTS if told[name] is not None}


def _read(kind: str, path: str, choice: Choice) -> Samples:
    """Return the samples of a file of that kind; the reader and its library are imported here."""
    with nullcontext() if kind in _WITHOUT_LIBRARY else silent_libraries():
        module = import_module(f"texvol.formats.readers.{kind.lower()}")
        samples: Samples = module.read(path, choice)
        if not choice.missing:
            return samples
        if samples.colors is not None:
            raise FileFault("--missing is for numbers, got colours: --channel N reads one component as numbers")
        if kind in _RESAMPLED:
            return samples
        values, notes = without_chosen(samples.values, choice)
        return samples._replace(values=values, notes=(*samples.notes, *notes))


@contextmanager
def silent_libraries() -> Iterator[None]:
    """Keep warnings and log lines of libraries off stderr; what matters becomes an error."""
    import logging
    import warnings

    disabled = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(disabled)
