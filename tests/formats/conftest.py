"""Files of these tests lie in memory where there is room: on a disk, writing a store waits for each of its chunks."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

_IN_MEMORY = "/dev/shm"
_ROOM = 2 << 30  # bytes: a test leaves some 60 MB at most, while two processes run tests


def _in_memory() -> str | None:
    """Return a folder in memory, or None for that of temporary files."""
    with suppress(OSError):
        if os.access(_IN_MEMORY, os.W_OK) and shutil.disk_usage(_IN_MEMORY).free > _ROOM:
            return _IN_MEMORY
    return None


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """Folder of one test, which goes with it."""
    with tempfile.TemporaryDirectory(prefix="texvol-test-", dir=_in_memory(), ignore_cleanup_errors=True) as folder:
        yield Path(folder)
