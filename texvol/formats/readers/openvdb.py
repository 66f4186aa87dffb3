"""OpenVDB: a sparse grid, made dense within the box of its active voxels, by the module of OpenVDB itself.

The module is the operating system's (Debian and Ubuntu: python3-openvdb) and belongs to the system's Python, so that a
process of that one reads the file. Voxels that are not active have the grid's background value.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size, grid_from_columns, pick
from texvol.util.errors import MissingExtraError
from texvol.util.memory import free_memory
from texvol.util.shown_text import shown_line
from texvol.util.terminal import library_reason

_PYTHONS = (sys.executable, "/usr/bin/python3")
_PATIENCE = 10.0  # seconds, in addition to the time for a file at this many bytes a second
_BYTES_A_SECOND = 2**23
_HEADER = "<8s3I?36s"  # magic, versions of the file and of the library, are there positions, identifier
_VERSION = 222  # of files from 2013 on; earlier ones have another header
_UNIQUE = b"\x1e"  # before the number that OpenVDB adds to a name
_LONGEST = 1 << 16  # bytes of a text that are read
_ROOM = 1 << 29  # bytes of the process beside the samples
_SCRIPT = Path(__file__).with_name("openvdb_process.py")


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of the grid that --variable names, or of the only one."""
    _check_whole(path)
    with tempfile.TemporaryDirectory(prefix="texvol-") as folder:
        samples = os.path.join(folder, "samples")
        about = _asked(path, choice.variable or "", samples)
        sizes, channels = [int(size) for size in about["sizes"]], int(about["channels"])
        axes = "ZYX" + "C" * (channels > 1)
        shape = [*sizes[::-1], *([channels] if channels > 1 else [])]
        index = pick(axes, shape, choice)
        check_size(shape, 4)
        # OpenVDB's arrays have z fastest.
        stored = np.fromfile(samples, np.float32).reshape(*sizes, *shape[3:])
    values = np.ascontiguousarray(np.moveaxis(stored, (0, 1, 2), (2, 1, 0))[index])
    spacing, direction = grid_from_columns(np.array(about["columns"]).T)
    return Samples(values, spacing.tolist(), about["origin"], direction, notes=tuple(about["notes"]))


def _check_whole(path: str) -> None:
    """Raise FileFault if the file ends before its grids do; OpenVDB would search for the rest without an end.

    After the header each grid has a name, its type, the name of an instance, and the positions of its beginning, of its
    blocks and of its end, where the next grid begins.
    """
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        *_, version, _, _, has_positions, _ = _numbers(file, _HEADER)
        if version < _VERSION or not has_positions:
            return
        for _ in range(_numbers(file, "<I")[0]):
            for _ in range(3):  # of metadata: name, type and value
                _text(file)
        for _ in range(_numbers(file, "<I")[0]):
            name, *_ = (_text(file) for _ in range(3))
            *_, end = _numbers(file, "<3q")
            if end > size:
                shown = shown_line(name.partition(_UNIQUE)[0].decode("utf-8", "replace"))[:60]
                raise FileFault(f"is truncated: grid {shown} ends at byte {end}, and the file has {size}")
            if end <= file.tell():
                raise FileFault(f"is corrupt: a grid ends at byte {end}, before it begins")
            file.seek(end)


def _numbers(file: BinaryIO, form: str) -> tuple[Any, ...]:
    content = file.read(struct.calcsize(form))
    if len(content) < struct.calcsize(form):
        raise FileFault(f"is truncated: it ends at byte {file.tell()}, within its header")
    return struct.unpack(form, content)


def _text(file: BinaryIO) -> bytes:
    """Return a text, or another thing that begins with its length."""
    (length,) = _numbers(file, "<I")
    content: bytes = _numbers(file, f"{min(length, _LONGEST)}s")[0]
    if length > _LONGEST:
        file.seek(length - _LONGEST, os.SEEK_CUR)
    return content


def _asked(path: str, name: str, samples: str) -> dict[str, Any]:
    """Return what the process says of the grid, whose samples it has written."""
    room, seconds = free_memory(), _PATIENCE + os.path.getsize(path) / _BYTES_A_SECOND
    for python in dict.fromkeys(_PYTHONS):
        if not os.path.exists(python):
            continue
        line = [python, "-I", str(_SCRIPT), os.path.abspath(path), name, samples, str(room // 2), str(room + _ROOM)]
        try:
            done = subprocess.run(line, capture_output=True, timeout=seconds, check=False)
        except subprocess.TimeoutExpired:
            raise FileFault(f"is corrupt or too complex: it is not read within {seconds:.0f} seconds") from None
        if done.returncode == 3:  # this Python has no such module
            continue
        try:
            about: dict[str, Any] = json.loads(done.stdout)
        except ValueError:
            raise FileFault(f"is corrupt: reading it crashes the library (status {done.returncode})") from None
        if "fault" in about:
            raise FileFault(library_reason(about["fault"]))
        return about
    raise MissingExtraError(f"{path}: reading OpenVDB needs the system's module pyopenvdb: apt install python3-openvdb")
