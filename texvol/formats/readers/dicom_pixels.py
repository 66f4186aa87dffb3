"""The pixels of DICOM slices, a frame at a time; compressed ones are unpacked in a process that may die.

On damaged streams the decoders raise exceptions of C++ that nobody catches, which end their process, or print what is
wrong and go on with grey. Both become an error here.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from itertools import islice
from typing import IO

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import Child, Died, Late, forked
from texvol.formats.readers.dicom_slices import Slice
from texvol.formats.readers.samples import FileFault, in_bytes
from texvol.util.errors import missing_extra
from texvol.util.terminal import one_line

# A message is its kind, the number of its bytes, and these: a frame in the slice's type, or what is wrong.
_HEAD = struct.Struct("<cQ")
_FRAME, _FAULT = b"F", b"E"
_PATIENCE = 8.0  # seconds without a frame, beside those for a frame of this many bytes a second
_BYTES_A_SECOND = 2**23
_ROOM = 2**30  # bytes that the process may take beside what it begins with
_MOST_READ = 2**20


def pixels_of(ordered: Sequence[Slice]) -> Iterator[tuple[int, NDArray]]:
    """Number among `ordered`, and stored pixels, of each slice: file by file, and in each of these as frames follow.

    Raises
    ------
    FileFault
        If the pixels of one can't be read; it names the file.
    MissingExtraError
        If there is no decoder.
    """
    positions: dict[str, dict[int, int]] = {}
    for number, one in enumerate(ordered):
        positions.setdefault(one.path, {})[one.frame] = number
    files = [ordered[next(iter(frames.values()))]._replace(frames=max(frames) + 1) for frames in positions.values()]
    packed = [one for one in files if one.syntax]
    for one in {one.syntax: one for one in packed}.values():
        _check_decoder(one)
    with closing(_unpacked(packed)) as unpacked:
        for one in files:
            frames = positions[one.path]
            for frame, pixels in enumerate(next(unpacked) if one.syntax else _frames(one)):
                if frame in frames:
                    yield frames[frame], one.stored(pixels)


def _frames(one: Slice) -> Iterator[NDArray]:
    """Frames of a slice's file, decoded in this process; FileFault if there are fewer than it says."""
    import pydicom
    from pydicom.pixels import get_decoder

    try:
        dataset = pydicom.dcmread(one.path, force=True)
        decoder = get_decoder(dataset.file_meta.TransferSyntaxUID)
        count = 0
        for pixels, _ in islice(decoder.iter_array(dataset), one.frames):
            yield pixels if pixels.dtype.kind == "f" else pixels.astype(one.dtype, copy=False)
            count += 1
    except Exception as error:
        raise _unreadable(one, error) from error
    if count < one.frames:
        raise _unreadable(one, f"it says that there are {one.frames} frames, and has {count}")


def _unreadable(one: Slice, reason: object) -> FileFault:
    return FileFault(f"{os.path.basename(one.path)}: its pixels can't be read: {one_line(reason)}")


def _check_decoder(one: Slice) -> None:
    from pydicom.pixels import get_decoder
    from pydicom.uid import UID

    kind = UID(one.syntax).name
    try:
        decoder = get_decoder(UID(one.syntax))
    except NotImplementedError:
        raise _unreadable(one, f"{kind} is not read") from None
    if not decoder.is_available:
        raise missing_extra("python-gdcm", "formats", f"{one.path}: unpacking {kind}")


def _unpacked(packed: Sequence[Slice]) -> Generator[Iterator[NDArray], None, None]:
    """For each file in turn an iterator of its frames, which a process of their own unpacks."""
    if packed:
        with forked(lambda output: _unpack(packed, output)) as child:
            for one in packed:
                yield _received(one, child)


def _received(one: Slice, child: Child) -> Iterator[NDArray]:
    seconds = _PATIENCE + one.frame_bytes / _BYTES_A_SECOND
    for _ in range(one.frames):
        try:
            kind, size = _HEAD.unpack(child.take(_HEAD.size, seconds))
            content = child.take(size, seconds)
        except Late:
            raise _unreadable(one, "its compressed data are damaged: unpacking them does not end") from None
        except Died as died:
            raise _unreadable(one, f"its compressed data are damaged, and the decoder broke off ({died})") from None
        if kind == _FAULT:
            raise FileFault(content.decode("utf-8", "replace"))
        yield np.frombuffer(content, one.dtype).reshape(one.frame_shape)


def _unpack(packed: Sequence[Slice], output: IO[bytes]) -> None:
    """Write the files' frames into the pipe."""
    import tempfile

    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), 2)
        for one in packed:
            _limit_memory(one)
            _send_file(one, output, printed)


def _send_file(one: Slice, output: IO[bytes], printed: IO[bytes]) -> None:
    """Write the frames of a file, each once it is known to be sound."""
    try:
        for pixels in _frames(one):
            _check_printed(one, printed)
            if pixels.shape != one.frame_shape:
                raise _unreadable(one, f"its frame is of shape {pixels.shape}, and not {one.frame_shape}")
            _send(output, _FRAME, np.ascontiguousarray(pixels, one.dtype).data.cast("B"))
        return
    except FileFault as fault:
        message = str(fault)
    except MemoryError:
        message = str(_unreadable(one, f"a frame of {in_bytes(one.frame_bytes)} takes more memory than that to unpack"))
    _send(output, _FAULT, memoryview(message.encode()))


def _check_printed(one: Slice, printed: IO[bytes]) -> None:
    """FileFault if a decoder has printed that a picture is damaged, and made grey of the rest."""
    printed.seek(0)
    for line in printed.read().decode("utf-8", "replace").splitlines():
        if "orrupt" in line or "remature" in line:
            raise _unreadable(one, line)


def _send(output: IO[bytes], kind: bytes, content: memoryview) -> None:
    output.write(_HEAD.pack(kind, content.nbytes))
    at = 0
    while at < content.nbytes:
        at += output.write(content[at : at + _MOST_READ])


def _limit_memory(one: Slice) -> None:
    """Let the process take no more memory than its file and a few of its frames need: a stream may ask for any."""
    import resource

    with open("/proc/self/statm", encoding="ascii") as numbers:
        begun_with = int(numbers.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    wanted = begun_with + _ROOM + 2 * os.path.getsize(one.path) + 8 * one.frame_bytes
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (wanted if most < 0 else min(wanted, most), most))
