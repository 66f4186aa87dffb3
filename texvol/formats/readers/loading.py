"""A file to a Volume: the reader of its format, and one place where what goes wrong becomes a line."""

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

# Of `texvol.formats.readers.load`, which a volume's source keeps.
ARGUMENTS = (
    *("shape", "dtype", "series", "channel", "time", "variable", "resolution", "spacing", "labels", "color"),
    "missing",
)

_WITHOUT_LIBRARY = ("NPY", "raw")  # that could print anything
_RESAMPLED = ("netCDF", "VTR", "VTS")  # which leave out what is missing themselves, before it is mixed with the rest


def read(name: str, choice: Choice) -> Samples:
    """Samples of the file `name`.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.formats.readers.load` says.
    TimeSteps
        If the steps are to be counted, and the format may have several.
    """
    with named_faults(name, "a volume", "formats"):
        _check(choice)
        kind = format_of(name, choice)
    with named_faults(name, kind, "formats"):
        return _read(kind, name, choice)


def _check(choice: Choice) -> None:
    """Raise FileFault if what the user says of the samples can't be true together."""
    if choice.color and choice.labels:
        raise FileFault("its samples are labels or colours, and not both: --labels or --color")
    if choice.color and choice.channel is not None:
        raise FileFault("one channel has no colour: --channel or --color")
    if choice.missing and choice.labels:
        raise FileFault("labels are names, and none is missing: --label-look LABEL=0 hides one, and --missing does not")


def volume_of(name: str, samples: Samples, choice: Choice, spacing: Sequence[float] | None) -> Volume:
    """The volume that samples of the file `name` make; `spacing` stands for the file's."""
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
    """How the volume is read again."""
    told = {key: getattr(choice, key) for key in ARGUMENTS if key != "spacing"}
    told["labels"] = choice.labels or None
    told["missing"] = list(choice.missing) or None
    told["spacing"] = None if spacing is None else [float(number) for number in spacing]
    position = {"path": path, "absolute": os.path.abspath(path)}
    return position | {name: told[name] for name in ARGUMENTS if told[name] is not None}


def _read(kind: str, path: str, choice: Choice) -> Samples:
    """Samples of a file of that kind; a reader, and the library that it stands on, is imported when it is needed."""
    with nullcontext() if kind in _WITHOUT_LIBRARY else silent_libraries():
        module = import_module(f"texvol.formats.readers.{kind.lower()}")
        samples: Samples = module.read(path, choice)
        if not choice.missing:
            return samples
        if samples.colors is not None:
            raise FileFault("no colour stands for a missing sample: --missing is for numbers, which --channel N reads")
        if kind in _RESAMPLED:
            return samples
        values, notes = without_chosen(samples.values, choice)
        return samples._replace(values=values, notes=(*samples.notes, *notes))


@contextmanager
def silent_libraries() -> Iterator[None]:
    """Keep the libraries' warnings and log lines off stderr: what matters of them is in the error or not an error."""
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
