"""Samples stored raw, compressed or as text in a file; no more is read than the header's dimensions need.

A header is trusted only as far as the file's size and the machine's memory allow, and a compressed stream is unpacked
to at most one byte more than needed.
"""

from __future__ import annotations

import bz2
import os
import re
import zlib
from collections.abc import Iterator, Sequence
from math import prod
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, by, check_size, in_bytes, native, once, real_type
from texvol.util import reach

_BLOCK = 2**20  # bytes unpacked per step
_PIECE = 2**15  # bytes read per step: the rest after each stream is copied, and streams may be short
_LEADING = 2**26  # bytes that may precede the samples in a stream whose samples come last

_MOST_FILES = 10**5  # of a pattern
_PATTERN = re.compile(r"(?:[^%]|%%)*%0?\d{0,2}[diu](?:[^%]|%%)*")

LONGEST_HEADER = 2**20  # bytes of text
WORD_BYTES = 64  # memory of a number that is still a word: a Python string and its slot in a list

MAGIC = {"raw": b"", "deflate": b"\x1f\x8b", "bzip2": b"BZh"}  # first bytes of files

# Deflate packs at best 258 bytes into two bits: 1032 to 1 (RFC 1951). Bzip2 has no such bound worth using.
_BEST_DEFLATE = 1032


class Stored(NamedTuple):
    """Samples stored in a file: a real type of at most 64 bits in the file's byte order, and their shape.

    They begin after `offset` bytes and `lines` lines of the file, and `skip` bytes of the unpacked rest; skip -1 means
    that they are at the end, and for text it is ignored. The encoding is "raw", "deflate" (zlib or gzip), "bzip2",
    "ascii" (decimal numbers) or "hex" (two digits per byte). `what` is the name of the file in messages. Unless
    `is_last` more may follow samples that are bytes.
    """

    path: str
    dtype: np.dtype
    sizes: tuple[int, ...]
    encoding: str = "raw"
    offset: int = 0
    lines: int = 0
    skip: int = 0
    is_last: bool = True
    what: str = "it"

    @property
    def nbytes(self) -> int:
        """Number of unpacked bytes."""
        return prod(self.sizes) * self.dtype.itemsize


def read_picked(stored: Stored, index: tuple[int | slice, ...], choice: Choice) -> NDArray:
    """Return the samples at `index`; faults are those of `read_stored`.

    Of raw samples only the picked part is read. Compressed samples are unpacked as a whole, once for all steps of a
    series.
    """
    sizes = stored.sizes
    axes, number, parts = 0, 0, 1  # of the leading axes along which one index is picked
    for chosen, size in zip(index, sizes, strict=True):
        if isinstance(chosen, slice):
            break
        axes, number, parts = axes + 1, number * size + chosen, parts * size
    if parts != 1 and stored.encoding == "raw":
        real_type(stored.dtype)
        if min(sizes) < 1:
            raise FileFault(f"every dimension must be positive, got {by(sizes)}")
        return read_stored(stored._replace(sizes=sizes[axes:]), number, parts)[index[axes:]]
    whole = once(choice, stored, lambda: read_stored(stored))
    picked = whole[index]
    # A copy does not keep the whole array in memory; the steps of a series share it.
    return picked if choice.kept is not None or picked.size == whole.size else picked.copy()


def read_stored(stored: Stored, part: int = 0, parts: int = 1) -> NDArray:
    """Return samples of a file, in shape; of raw samples, array number `part` among `parts` consecutive arrays.

    Raises
    ------
    FileFault
        If there are fewer or more bytes than the samples need, or they can't be unpacked or do not fit into memory.
    InputError
        If the file is out of reach, see `texvol.util.reach`.
    """
    real_type(stored.dtype)
    needed = check_size(stored.sizes, stored.dtype.itemsize)
    reach.check(stored.path)
    with open(stored.path, "rb") as file:
        file.seek(stored.offset)
        _skip_lines(file, stored)
        if stored.encoding in ("ascii", "hex"):
            return _read_text(file, stored)
        if stored.encoding == "raw":
            return _read_plain(file, stored, part, parts)
        begin, skip, what = file.tell(), stored.skip, stored.what
        packed = os.fstat(file.fileno()).st_size - begin
        if stored.encoding == "deflate" and needed > packed * _BEST_DEFLATE:
            raise FileFault(
                f"{what} holds {packed} compressed bytes, but the header's dimensions need {in_bytes(needed)}"
            )
        if skip > _LEADING:
            raise FileFault(f"the header may skip at most {_LEADING} bytes of the unpacked {what}, got {skip}")
        if skip < 0:
            total = sum(len(block) for block in _bounded(unpacked(file, stored.encoding), needed + _LEADING, what))
            if total < needed:
                raise _wrong_size(stored, total)
            skip = total - needed
            file.seek(begin)
        return _read_packed(unpacked(file, stored.encoding), stored, skip)


def _read_plain(file: IO[bytes], stored: Stored, part: int, parts: int) -> NDArray:
    begin, needed = file.tell(), stored.nbytes * parts
    held = os.fstat(file.fileno()).st_size - begin
    skip = held - needed if stored.skip < 0 else stored.skip
    if held - skip - needed in (1, 2):  # a line break after the last sample, as of text editors and printf
        file.seek(begin + skip + needed)
        rest = file.read(2)
        held -= len(rest) if rest in (b"\n", b"\r\n") else 0
    if skip < 0 or held - skip < needed or (stored.is_last and held - skip != needed):
        raise _wrong_size(stored, max(held - max(skip, 0), 0), parts)
    file.seek(begin + skip + part * stored.nbytes)
    values = np.fromfile(file, stored.dtype, prod(stored.sizes))
    if values.nbytes != stored.nbytes:
        raise _wrong_size(stored, values.nbytes)
    return native(values).reshape(stored.sizes)


def _read_packed(blocks: Iterator[bytes], stored: Stored, skip: int) -> NDArray:
    values = np.empty(stored.sizes, stored.dtype)
    target = values.reshape(-1).view(np.uint8)
    seen = 0  # bytes unpacked so far, the skipped ones included
    for block in blocks:
        first = max(skip - seen, 0)
        at = max(seen - skip, 0)
        if not stored.is_last:
            block = block[: first + stored.nbytes - at]
        seen += len(block)
        if seen - skip > stored.nbytes:
            raise _wrong_size(stored, None)
        target[at : at + max(len(block) - first, 0)] = np.frombuffer(block, np.uint8)[first:]
        if not stored.is_last and seen - skip == stored.nbytes:
            break
    if seen - skip != stored.nbytes:
        raise _wrong_size(stored, max(seen - skip, 0))
    return native(values)


def _read_text(file: IO[bytes], stored: Stored) -> NDArray:
    count, what = prod(stored.sizes), stored.what
    if os.fstat(file.fileno()).st_size - file.tell() < count:
        raise FileFault(f"{what} is too short to hold {count} samples as text")
    check_size(stored.sizes, WORD_BYTES)
    text = file.read().decode("ascii")
    if stored.encoding == "hex":
        content = bytes.fromhex(text)
        if len(content) != stored.nbytes:
            raise FileFault(f"{what} must hold {stored.nbytes} bytes of samples by its header, got {len(content)}")
        return np.frombuffer(content, stored.dtype).reshape(stored.sizes)
    words = text.split()
    if len(words) != count:
        raise FileFault(f"{what} must hold {count} numbers by its header, got {len(words)}")
    return from_words(words, stored.dtype).reshape(stored.sizes)


def from_words(words: Sequence[str], dtype: np.dtype) -> NDArray:
    """Return numbers written as text; whole numbers by Python's, so that 300 is no uint8 and does not become 44."""
    return np.array(words if dtype.kind == "f" else [int(word) for word in words], dtype)


def _wrong_size(stored: Stored, held: int | None, parts: int = 1) -> FileFault:
    needed = stored.nbytes * parts
    said = f"{stored.what} holds {f'more than {needed}' if held is None else held} bytes of samples"
    return FileFault(f"{said}, but the header's dimensions and type need {needed}")


def encoding_of(path: str) -> str:
    """Return the encoding of a file by its name, which may end with .gz or .bz2."""
    return {".gz": "deflate", ".mgz": "deflate", ".bz2": "bzip2"}.get(os.path.splitext(path)[1].lower(), "raw")


def header_of(path: str, encoding: str, size: int) -> bytes:
    """Return the first block of a file, of `size` bytes at least.

    Raises
    ------
    FileFault
        If the file is shorter.
    """
    with open(path, "rb") as file:
        head = next(unpacked(file, encoding), b"") if encoding != "raw" else file.read(size)
    if len(head) < size:
        raise FileFault(f"is truncated: its header of {size} bytes has {len(head)}")
    return head


def unpacked(file: IO[bytes], encoding: str) -> Iterator[bytes]:
    """Yield the content of a compressed stream in blocks of bounded size; checksums are verified at its end.

    Consecutive streams count as one; padding after them is ignored.
    """
    make = bz2.BZ2Decompressor if encoding == "bzip2" else lambda: zlib.decompressobj(zlib.MAX_WBITS | 32)
    pending = file.read(_PIECE)
    while True:
        stream: Any = make()
        while not stream.eof:
            block = stream.decompress(pending, _BLOCK)
            if block:
                yield block
            pending = getattr(stream, "unconsumed_tail", b"")
            hungry = getattr(stream, "needs_input", not pending)
            if not stream.eof and hungry and not pending:
                pending = file.read(_PIECE)
                if not pending and not block:
                    raise FileFault("is truncated: its compressed data end in the middle")
        pending = stream.unused_data or file.read(_PIECE)
        if len(pending) < len(MAGIC[encoding]):
            pending += file.read(_PIECE)
        if not pending.startswith(MAGIC[encoding]):
            return


def _bounded(blocks: Iterator[bytes], limit: int, what: str) -> Iterator[bytes]:
    seen = 0
    for block in blocks:
        seen += len(block)
        if seen > limit:
            raise FileFault(f"{what} unpacks to more than {in_bytes(limit)}, but the header's dimensions need less")
        yield block


def _skip_lines(file: IO[bytes], stored: Stored) -> None:
    """Skip the lines before the samples; raise FileFault if there are fewer."""
    held = os.fstat(file.fileno()).st_size
    for number in range(stored.lines):
        if file.tell() >= held:
            raise FileFault(f"the header skips {stored.lines} lines, but {stored.what} holds {number}")
        while (piece := file.readline(_BLOCK)) and not piece.endswith(b"\n"):
            pass


def header_lines(file: IO[bytes]) -> Iterator[str]:
    """Yield the lines of a text header, which must end within a limit."""
    while line := file.readline(LONGEST_HEADER):
        if file.tell() > LONGEST_HEADER:
            raise FileFault(f"its header does not end within {LONGEST_HEADER} bytes")
        yield line.decode("latin-1")


def data_files(stored: Stored, path: str, offset: int, named: str | None, listed: Sequence[str] | None) -> list[Stored]:
    """Return the samples `stored` after a header, or in the data files that it names, each of the shape of all.

    `named` is a file's name, or a pattern as for `_numbered_names`, which NRRD lets a dimension follow; `listed` are
    the names if the header lists them. The files must exist in the header's folder or below, else FileFault is raised.
    """
    if named is None:
        return [stored._replace(path=path, offset=offset)]
    words = named.split()
    if listed is None and len(words) in (4, 5) and "%" in words[0]:
        listed = _numbered_names(words[:4])
    names = [named] if listed is None else listed
    return [stored._replace(path=_data_file(path, name), what=f"its data file {name}") for name in names]


def read_files(files: Sequence[Stored], index: tuple[int | slice, ...], choice: Choice) -> NDArray:
    """Return the samples at `index` from files that hold equal parts."""
    if len(files) == 1:
        return read_picked(files[0], index, choice)

    def of_all_files() -> NDArray:
        sizes, dtype = files[0].sizes, files[0].dtype
        check_size(sizes, dtype.itemsize)
        values = np.empty((len(files), prod(sizes) // len(files)), dtype)
        for each, slot in zip(files, values, strict=True):
            slot[...] = read_stored(each._replace(sizes=slot.shape))
        return values.reshape(sizes)

    return once(choice, "data files", of_all_files)[index]


def _numbered_names(words: Sequence[str]) -> list[str]:
    """Return names of data files by a pattern such as "slice%03d.raw", the first number, the last number and the step.

    Raises
    ------
    FileFault
        If the pattern is malformed, or gives no file or too many files.
    """
    said = " ".join(words)
    if not _PATTERN.fullmatch(words[0]):
        raise FileFault(f"the names of its data files must have one number, such as %03d, got {said[:80]!r}")
    try:
        first, last, step = (int(word) for word in words[1:])
    except ValueError:
        raise FileFault(f"the numbers of its data files must be first, last and step, got {said[:80]!r}") from None
    count = (last - first) // step + 1 if step else 0
    if not 1 <= count <= _MOST_FILES:
        raise FileFault(f"the number of its data files must be 1 to {_MOST_FILES}, got {count}: {said[:80]!r}")
    return [words[0] % (first + number * step) for number in range(count)]


def _data_file(header_path: str, name: str) -> str:
    folder = os.path.realpath(os.path.dirname(header_path) or ".")
    if os.path.isabs(name):
        raise FileFault(f"its data file {name} must be in the header's folder, got an absolute path")
    path = os.path.realpath(os.path.join(folder, name))
    if os.path.commonpath([folder, path]) != folder:
        raise FileFault(f"its data file {name} lies outside the header's folder")
    if not os.path.exists(path):
        raise FileFault(f"its data file {name} does not exist")
    if not os.path.isfile(path):
        raise FileFault(f"its data file {name} is not a regular file")
    return path
