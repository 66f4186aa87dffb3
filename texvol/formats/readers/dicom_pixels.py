"""Pixels of DICOM slices, one frame at a time; compressed frames are decoded in a child process.

On damaged streams the decoders throw C++ exceptions that end their process, or print a message and continue with grey.
Both become an error here.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from itertools import islice
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import Child, forked
from texvol.formats.readers.dicom_slices import Slice
from texvol.formats.readers.samples import FileFault, in_bytes
from texvol.util.errors import missing_extra
from texvol.util.terminal import library_reason

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

# For each frame the process sends an error text, empty if there is none, and then its pixels in the slice's type.
_PATIENCE = 8.0  # seconds without a frame, in addition to the time for a frame at this many bytes a second
_BYTES_A_SECOND = 2**23
_ROOM = 2**30  # bytes that the process may allocate beyond its initial size


def pixels_of(ordered: Sequence[Slice]) -> Iterator[tuple[int, NDArray]]:
    """Yield the number among `ordered` and the stored pixels of each slice, file by file.

    Raises
    ------
    FileFault
        If pixels can't be read; it names the file.
    MissingExtraError
        If there is no decoder.
    """
    positions: dict[str, dict[int, int]] = {}
    for number, one in enumerate(ordered):
        positions.setdefault(one.path, {})[one.frame] = number
    files = [ordered[next(iter(frames.values()))].replaced(frames=max(frames) + 1) for frames in positions.values()]
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
    """Yield frames of a slice's file, decoded in this process; raise FileFault if there are too few."""
    import pydicom
    from pydicom.pixels import get_decoder

    try:
        dataset = pydicom.dcmread(one.path, force=True)
        decoder = get_decoder(dataset.file_meta.TransferSyntaxUID)
        count = 0
        for pixels, _ in islice(decoder.iter_array(dataset), one.frames):
            yield pixels.astype(one.dtype, copy=False)
            count += 1
    except Exception as error:
        raise _unreadable(one, error) from error
    if count < one.frames:
        raise _unreadable(one, f"the header has {one.frames} frames, and the file {count}")


def _unreadable(one: Slice, reason: object) -> FileFault:
    return FileFault(f"{os.path.basename(one.path)}: its pixels can't be read: {library_reason(reason)}")


def _check_decoder(one: Slice) -> None:
    from pydicom.pixels import get_decoder
    from pydicom.uid import UID

    kind = UID(one.syntax).name
    try:
        decoder = get_decoder(UID(one.syntax))
    except NotImplementedError:
        raise _unreadable(one, f"texvol does not read {kind}") from None
    if not decoder.is_available:
        raise missing_extra("python-gdcm", "formats", f"{one.path}: unpacking {kind}")


def _unpacked(packed: Sequence[Slice]) -> Generator[Iterator[NDArray], None, None]:
    """Yield an iterator of frames for each file; a child process decodes them."""
    if packed:
        with forked(lambda output: _unpack(packed, output)) as child:
            for one in packed:
                yield _received(one, child)


def _received(one: Slice, child: Child) -> Iterator[NDArray]:
    seconds = _PATIENCE + one.frame_bytes / _BYTES_A_SECOND
    for _ in range(one.frames):
        try:
            if fault := child.take(seconds):
                raise FileFault(fault.decode("utf-8", "replace"))
            content = child.take(seconds)
        except TimeoutError:
            raise _unreadable(one, "its compressed data are damaged: decoding does not end") from None
        except EOFError as end:
            raise _unreadable(one, f"its compressed data are damaged: the decoder crashed ({end})") from None
        yield np.frombuffer(content, one.dtype).reshape(one.frame_shape)


def _unpack(packed: Sequence[Slice], output: Connection) -> None:
    """Send the files' frames."""
    import tempfile

    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), 2)
        for one in packed:
            _limit_memory(one)
            _send_file(one, output, printed)


def _send_file(one: Slice, output: Connection, printed: IO[bytes]) -> None:
    """Send the frames of a file, each after it is checked."""
    try:
        for pixels in _frames(one):
            _check_printed(one, printed)
            if pixels.shape != one.frame_shape:
                raise _unreadable(one, f"its frame must have shape {one.frame_shape}, got {pixels.shape}")
            output.send_bytes(b"")
            output.send_bytes(np.ascontiguousarray(pixels, one.dtype).data.cast("B"))
        return
    except FileFault as error:
        fault = error
    except MemoryError:
        fault = _unreadable(one, f"decoding a frame of {in_bytes(one.frame_bytes)} needs too much memory")
    output.send_bytes(str(fault).encode())


def _check_printed(one: Slice, printed: IO[bytes]) -> None:
    """Raise FileFault if a decoder has printed that a picture is damaged; it fills the rest with grey."""
    printed.seek(0)
    for line in printed.read().decode("utf-8", "replace").splitlines():
        if "orrupt" in line or "remature" in line:
            raise _unreadable(one, line)


def _limit_memory(one: Slice) -> None:
    """Limit the process to the memory that its file and a few frames need, since a stream may ask for any amount."""
    import resource

    with open("/proc/self/statm", encoding="ascii") as numbers:
        begun_with = int(numbers.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    wanted = begun_with + _ROOM + 2 * os.path.getsize(one.path) + 8 * one.frame_bytes
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (wanted if most < 0 else min(wanted, most), most))
