"""Loading of a file into a Volume by the reader of its format; errors are one line that names the file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib import import_module
from typing import Any

from texvol.formats import label_tables
from texvol.formats.readers.detection import RESAMPLED, UNSTRUCTURED, extra_of, format_of, located, reader_of
from texvol.formats.readers.magnitude import MAGNITUDE, magnitudes
from texvol.formats.readers.missing import marks_of, without_chosen
from texvol.formats.readers.samples import COUNTED, AxisLength, Choice, FileFault, Samples, TimeSteps
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, TexvolError, missing_extra
from texvol.util.locations import absolute, public
from texvol.util.terminal import fault_of, library_reason

# Arguments of `texvol.formats.readers.load` that a volume's source keeps.
ARGUMENTS = tuple(name for name in Choice._fields if name not in ("memory", "counting", "kept"))

# Fields of Samples that only the volume of a store has.
_OF_STORES = ("levels", "channel", "channels", "images", "times", "time_unit", "check")
_WITHOUT_LIBRARY = ("NPY", "raw")  # need no library that could print


def checked(name: str, choice: Choice) -> Choice:
    """Return the arguments for the file `name` as readers take them; raise InputError if they contradict each other."""
    if choice.label_names not in (None, label_tables.NONE):
        choice = choice._replace(labels=True)  # who names labels has some
    with named_faults(name, "a volume", "formats"):
        missing = marks_of(choice.missing)
        if choice.color and choice.labels:
            raise FileFault("samples can't be both labels and colours: give --labels or --color")
        if isinstance(choice.channel, str) and choice.channel != MAGNITUDE:
            raise FileFault(f"channel must be a number or {MAGNITUDE}, got {choice.channel!r}")
        if choice.labels and choice.channel == MAGNITUDE:
            raise FileFault(f"labels have no magnitude: give --labels or --channel {MAGNITUDE}")
        if choice.blocks and choice.color:
            raise FileFault("blocks have no colours of their own: give --blocks or --color")
        if choice.color and choice.channel is not None:
            raise FileFault("a single channel has no colour: give --channel or --color")
        if missing and choice.labels:
            raise FileFault("--missing is not for labels: --label-look LABEL=0 hides a label")
        return choice._replace(
            shape=None if choice.shape is None else tuple(choice.shape),
            series=None if choice.series is None else str(choice.series),
            resolution=None if choice.resolution is None else tuple(choice.resolution),
            labels=bool(choice.labels),
            blocks=bool(choice.blocks),
            missing=missing,
            image=None if choice.image is None else str(choice.image),
            level=_level(choice.level),
            fix_pyramid=bool(choice.fix_pyramid),
            missing_chunks=bool(choice.missing_chunks),
            label_names=None if choice.label_names is None else label_tables.absolute(choice.label_names),
            resample=bool(choice.resample),
        )


def _level(told: Any) -> int | None:
    """Return the number of a level, or None for all of them."""
    if told is None or told == "auto":
        return None
    if isinstance(told, bool) or not isinstance(told, int) or told < 0:
        raise FileFault(f"level must be auto or a number from 0, got {told!r}")
    return told


def read(name: str, choice: Choice) -> Samples:
    """Return the samples of the file `name`; the reader of its format and its library are imported here.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.formats.readers.load`.
    TimeSteps
        If `choice.counting`, and the format may have several steps.
    """
    with named_faults(name, "a volume", "formats"):
        path, choice = located(name, choice)
        kind = format_of(path, choice)
    quiet = nullcontext() if kind in _WITHOUT_LIBRARY else silent_libraries()
    with named_faults(name, kind, extra_of(kind)), quiet:
        read_one = partial(_read, path, kind)
        return magnitudes(read_one, choice) if choice.channel == MAGNITUDE else read_one(choice)


def axis_length(name: str, choice: Choice, axis: str) -> int:
    """Return the number of channels (axis "C") or time steps ("T") of a file; 0 without such an axis.

    An axis without a name is one of channels if `choice` has no time, and one of time if it has no channel.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.formats.readers.load`.
    """
    asked = choice._replace(channel=COUNTED) if axis == "C" else choice._replace(time=COUNTED)
    try:
        read(name, asked)
    except AxisLength as length:
        return int(length.args[0])
    return 0


def _read(name: str, kind: str, choice: Choice) -> Samples:
    samples: Samples = import_module(reader_of(kind)).read(name, choice)
    if choice.missing and samples.colors is not None:
        raise FileFault("--missing is for numbers, got colours: --channel N reads one component as numbers")
    # Which mark missing samples themselves, before they interpolate, or whenever they read some.
    if not choice.missing or kind in RESAMPLED or samples.levels or choice.resample:
        return samples
    values, notes = without_chosen(samples.values, choice)
    return samples._replace(values=values, notes=(*samples.notes, *notes))


def read_tetrahedra(name: str, choice: Choice) -> TetrahedralGrid:
    """Return the field of the file `name` on tetrahedra, without resampling; raises as `read`."""
    with named_faults(name, "an unstructured grid", "formats"):
        path, choice = located(name, choice)
        kind = format_of(path, choice)
        if kind not in UNSTRUCTURED:
            raise FileFault(f"is {kind}: tetrahedra are read from {', '.join(UNSTRUCTURED)}")
    with named_faults(name, kind, "formats"), silent_libraries():
        grid: TetrahedralGrid
        grid, _ = import_module(reader_of(kind)).tetrahedra(path, choice)
        return grid


def volume_of(name: str, samples: Samples, choice: Choice) -> Volume:
    """Return the volume of the samples of the file `name`; a chosen spacing overrides the file's."""
    fields = samples._asdict()
    if choice.spacing is not None:
        fields["spacing"] = choice.spacing
    fields["labels"] = choice.labels or samples.labels
    fields |= {"name": public(name), "source": _source(name, choice), "blocks": choice.blocks}
    own = samples.label_table if choice.label_names is None else None
    fields["label_table"] = own or label_tables.table_for(name, choice.label_names)
    if not samples.levels:
        volume = Volume(**{key: thing for key, thing in fields.items() if key not in _OF_STORES})
        if len(samples.channels) > 1:
            volume.channel, volume.channels = samples.channel, samples.channels
        return volume
    from texvol.scene.large_volume import LargeVolume

    for key in ("values", "resampling", "colors"):
        del fields[key]
    table = fields.pop("label_table")
    volume = LargeVolume(**fields, memory=choice.memory)
    volume.label_table = table
    return volume.at_level(choice.level or 0)


def _source(path: str, choice: Choice) -> dict[str, Any]:
    """Return the arguments with which the volume is read again."""
    told = {name: getattr(choice, name) for name in ARGUMENTS}
    told["labels"], told["blocks"] = choice.labels or None, choice.blocks or None
    told["missing"] = list(choice.missing) or None
    told["spacing"] = None if choice.spacing is None else [float(number) for number in choice.spacing]
    for name in ("fix_pyramid", "missing_chunks", "resample"):
        told[name] = told[name] or None
    del told["level"]  # which the volume of that level has
    position = {"path": public(path), "absolute": public(absolute(path))}
    return position | {name: thing for name, thing in told.items() if thing is not None}


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


@contextmanager
def named_faults(name: str, kind: str, extra: str) -> Iterator[None]:
    """Turn errors of libraries into errors that name the file `name`, which is read as `kind`.

    Raises
    ------
    InputError
        If the file is malformed, can't be read, or needs too much memory.
    MissingExtraError
        If a library of `extra` is missing.
    """
    name = public(name)
    try:
        yield
    except FileFault as fault:
        # Readers of folders name the slice; for a single file that would repeat its name.
        reason = library_reason(fault).removeprefix(f"{os.path.basename(name)}: ")
        raise InputError(f"{name}: {reason}") from None
    except (TexvolError, TimeSteps, AxisLength):
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {library_reason(error.strerror or error)}") from error
    except MemoryError as error:
        raise InputError(f"{name}: reading it needs more memory than there is") from error
    except ImportError as error:
        raise missing_extra(error.name or str(error), extra, f"{name}: reading {kind}") from error
    except Exception as error:  # libraries raise anything on malformed files
        raise InputError(f"{name}: cannot be read as {kind}: {fault_of(error)}") from error
