"""A file to a Volume: the reader of its format, and one place where what goes wrong becomes a line."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Any

from texvol.errors import InputError, TexvolError, missing_extra
from texvol.readers.detection import format_of
from texvol.readers.samples import Choice, FileFault, Samples, TimeSteps
from texvol.terminal import one_line
from texvol.volume import Volume

# Of `texvol.readers.load`, which a volume's source keeps.
ARGUMENTS = ("shape", "dtype", "series", "channel", "time", "variable", "resolution", "spacing")

_WITHOUT_LIBRARY = ("NPY", "raw")  # that could print anything


def read(name: str, choice: Choice) -> Samples:
    """Samples of the file `name`.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.readers.load` says.
    TimeSteps
        If the steps are to be counted, and the format may have several.
    """
    kind = "a volume"
    try:
        kind = format_of(name, choice)
        return _read(kind, name, choice)
    except FileFault as fault:
        # Readers of folders name the slice; of a single file that would be said twice.
        reason = one_line(fault).removeprefix(f"{os.path.basename(name)}: ")
        raise InputError(f"{name}: {reason}") from None
    except (TexvolError, TimeSteps):
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {one_line(error.strerror or error)}") from error
    except MemoryError as error:
        raise InputError(f"{name}: reading it asks for more memory than there is") from error
    except ImportError as error:
        raise missing_extra(error.name or str(error), "formats", f"{name}: reading {kind}") from error
    except Exception as error:  # whatever a library raises on a file that it can't make sense of
        raise InputError(f"{name}: cannot be read as {kind}: {one_line(str(error) or type(error).__name__)}") from error


def volume_of(name: str, samples: Samples, choice: Choice, spacing: Sequence[float] | None) -> Volume:
    """The volume that samples of the file `name` make; `spacing` stands for the file's."""
    return Volume(
        samples.values,
        samples.spacing if spacing is None else spacing,
        samples.origin,
        samples.direction,
        unit=samples.unit,
        space=samples.space,
        name=name,
        source=_source(name, choice, spacing),
        resampling=samples.resampling,
        notes=samples.notes,
    )


def _source(path: str, choice: Choice, spacing: Sequence[float] | None) -> dict[str, Any]:
    """How the volume is read again."""
    told = {key: getattr(choice, key) for key in ARGUMENTS if key != "spacing"}
    told["spacing"] = None if spacing is None else [float(number) for number in spacing]
    place = {"path": path, "absolute": os.path.abspath(path)}
    return place | {name: told[name] for name in ARGUMENTS if told[name] is not None}


def _read(kind: str, path: str, choice: Choice) -> Samples:
    """Samples of a file of that kind; a reader, and the library that it stands on, is imported when it is needed."""
    with nullcontext() if kind in _WITHOUT_LIBRARY else _silent_libraries():
        module = import_module(f"texvol.readers.{kind.lower()}")
        samples: Samples = module.read(path, choice)
    return samples


@contextmanager
def _silent_libraries() -> Iterator[None]:
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
