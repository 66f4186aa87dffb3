"""Whatever goes wrong while a file is read, as one line that names it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from texvol.formats.readers.samples import FileFault, TimeSteps
from texvol.util.errors import InputError, TexvolError, missing_extra
from texvol.util.terminal import one_line


@contextmanager
def named_faults(name: str, kind: str, extra: str) -> Iterator[None]:
    """Turn what libraries raise inside into errors of the file `name`, which is read as `kind`.

    Raises
    ------
    InputError
        If the file is not what it should be, can't be read, or asks for more memory than there is.
    MissingExtraError
        If a library is missing that comes with `extra`.
    """
    try:
        yield
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
        raise missing_extra(error.name or str(error), extra, f"{name}: reading {kind}") from error
    except Exception as error:  # whatever a library raises on a file that it can't make sense of
        raise InputError(f"{name}: cannot be read as {kind}: {one_line(str(error) or type(error).__name__)}") from error
