"""Errors raised while a file is read, as one line that names the file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from texvol.formats.readers.samples import FileFault, TimeSteps
from texvol.util.errors import InputError, TexvolError, missing_extra
from texvol.util.terminal import library_reason


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
    try:
        yield
    except FileFault as fault:
        # Readers of folders name the slice; for a single file that would repeat its name.
        reason = library_reason(fault).removeprefix(f"{os.path.basename(name)}: ")
        raise InputError(f"{name}: {reason}") from None
    except (TexvolError, TimeSteps):
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {library_reason(error.strerror or error)}") from error
    except MemoryError as error:
        raise InputError(f"{name}: reading it needs more memory than there is") from error
    except ImportError as error:
        raise missing_extra(error.name or str(error), extra, f"{name}: reading {kind}") from error
    except Exception as error:  # libraries raise anything on malformed files
        raise InputError(
            f"{name}: cannot be read as {kind}: {library_reason(str(error) or type(error).__name__)}"
        ) from error
