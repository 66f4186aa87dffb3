"""Readers of stores by name, for `fuzz.py`: all that `info`, `render --plan` and `convert` read of one."""

from __future__ import annotations

import io
import itertools
import json
import math
from contextlib import redirect_stderr, redirect_stdout
from typing import Any

import tensorstore  # noqa: F401 (so that no process that is forked has to import it)

from texvol.cli import information
from texvol.cli.command_line import main
from texvol.formats.readers import load
from texvol.formats.stores.writing.files import open_file
from texvol.formats.stores.writing.metadata import multiscale
from texvol.scene.large_volume import LargeVolume, Level
from texvol.util.errors import InputError

_ROOM = 32_000_000  # bytes of samples that may be held
_FEW = 20_000  # chunks of a level, each of which is looked for: of more it takes seconds


def store(path: str, **told: Any) -> int:
    """Read what `info` shows of a store, and each level."""
    volume = load(path, memory=_ROOM, **told)
    metadata = information.metadata(volume)
    json.dumps(metadata, allow_nan=False)
    information.text(metadata)
    assert isinstance(volume, LargeVolume)
    few = [n for n, each in enumerate(volume.levels) if _chunks(each) < _FEW]
    return sum(volume.at_level(number).values.nbytes for number in few) + volume.overview.size * 8


def _chunks(level: Level) -> int:
    source = level.source
    return math.prod(-(-count // one) for count, one in zip(source.shape, source.chunk_shape, strict=True))


def plan(path: str, **told: Any) -> int:
    """Plan a picture of a store by the command line."""
    options = [f"--{name}={value}" for name, value in told.items()]
    printed, complained = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with redirect_stdout(printed), redirect_stderr(complained):
        status = main(["render", path, "--plan", "--size", "32x32", "--memory", f"{_ROOM}", *options])
    if status == 2:
        raise InputError(_written(complained).removesuffix("\n"))
    return len(_written(printed))


def _written(stream: io.TextIOWrapper) -> str:
    stream.seek(0)
    return stream.read()


def recording(path: str) -> int:
    """Read all that `convert` would write of a store."""
    opened, read = open_file(path, memory=_ROOM), 0
    for each in (opened.image, *opened.labels.values()):
        multiscale(each, [(1, 1, 1)], 3, [(0.0, 1.0)] * len(each.channels))
        for part in itertools.islice(each.parts(), 4):
            read += each.volume(part).values.nbytes
    return read
