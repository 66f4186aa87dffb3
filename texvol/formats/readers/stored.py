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
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import Choice, FileFault, by, check_size, in_bytes, native, once, real_type

_BLOCK = 2**20  # bytes unpacked per step
_PIECE = 2**15  # bytes read per step: the rest after each stream is copied, and streams may be short
_LEADING = 2**26  # bytes that may precede the samples in a stream whose samples come last

_MOST_FILES = 10**5  # of a pattern
_PATTERN = re.compile(r"(?:[^%]|%%)*%0?\d{0,2}[diu](?:[^%]|%%)*")

WORD_BYTES = 64  # memory of a number that is still a word: a Python string and its slot in a list

# Deflate packs at best 258 bytes into two bits: 1032 to 1 (RFC 1951). Bzip2 has no such bound worth using.
_BEST_DEFLATE = 1032


def read_picked(
    path: str, dtype: np.dtype, sizes: Sequence[int], index: Sequence[int | slice], choice: Choice, **where: Any
) -> NDArray:
    """Return the samples at `index`; `where` and the other arguments are those of `read_stored`.

    Of raw samples only the picked part is read. Compressed samples are unpacked as a whole, once for all steps of a
    series.
    """
    leading: list[int] = []
    for each in index:
        if isinstance(each, slice):
            break
        leading.append(each)
    if prod(sizes[: len(leading)]) != 1 and where.get("encoding", "raw") == "raw":
        real_type(dtype)
        if min(sizes) < 1:
            raise FileFault(f"every dimension must be positive, got {by(sizes)}")
        part = list(sizes[len(leading) :])
        parts = prod(sizes[: len(leading)])
        number = 0
        for chosen, size in zip(leading, sizes, strict=False):
            number = number * size + chosen
        return read_stored(path, dtype, part, **where, part=number, parts=parts)[tuple(index[len(leading) :])]
    whole = once(choice, (path, *where.items()), lambda: read_stored(path, dtype, sizes, **where))
    picked = whole[tuple(index)]
    # A copy does not keep the whole array in memory; the steps of a series share it.
    return picked if choice.kept is not None or picked.size == whole.size else picked.copy()


def read_stored(
    path: str,
    dtype: np.dtype,
    sizes: Sequence[int],
    *,
    encoding: str = "raw",
    offset: int = 0,
    lines: int = 0,
    skip: int = 0,
    what: str = "the file",
    part: int = 0,
    parts: int = 1,
) -> NDArray:
    """Return samples of a file.

    Parameters
    ----------
    path : str
    dtype : dtype
        Real, at most 64 bits, in the file's byte order.
    sizes : sequence of int
        Shape of the result, slowest axis first; with the type it gives the number of bytes.
    encoding : "raw", "deflate" (zlib or gzip), "bzip2", "ascii" (decimal numbers) or "hex" (two digits per byte)
    offset, lines, skip : int
        Begin of the samples: after `offset` bytes and `lines` lines of the file, and `skip` bytes of the unpacked rest;
        skip -1 means that the samples are at the end. For text `skip` is ignored.
    what : str
        Name of the file in messages.
    part, parts : int
        Number of the array to read among `parts` consecutive arrays; only for raw samples.

    Returns
    -------
    array of shape `sizes`

    Raises
    ------
    FileFault
        If there are fewer or more bytes than the samples need, or they can't be unpacked or do not fit into memory.
    """
    real_type(dtype)
    needed = check_size(sizes, dtype.itemsize)
    with open(path, "rb") as file:
        file.seek(offset)
        _skip_lines(file, lines, what)
        begin = file.tell()
        if encoding in ("ascii", "hex"):
            return _read_text(file, dtype, sizes, encoding, what)
        if encoding == "raw":
            return _read_plain(file, begin, dtype, sizes, needed, skip, what, part, parts)
        packed = os.fstat(file.fileno()).st_size - begin
        if encoding == "deflate" and needed > packed * _BEST_DEFLATE:
            raise FileFault(
                f"{what} holds {packed} compressed bytes, but the header's dimensions need {in_bytes(needed)}"
            )
        if skip > _LEADING:
            raise FileFault(f"the header may skip at most {_LEADING} bytes of the unpacked {what}, got {skip}")
        if skip < 0:
            total = sum(len(block) for block in _bounded(unpacked(file, encoding), needed + _LEADING, what))
            if total < needed:
                raise _wrong_size(what, total, needed)
            skip = total - needed
            file.seek(begin)
        return _read_packed(unpacked(file, encoding), dtype, sizes, needed, skip, what)


def _read_plain(
    file: IO[bytes],
    begin: int,
    dtype: np.dtype,
    sizes: Sequence[int],
    of_part: int,
    skip: int,
    what: str,
    part: int,
    parts: int,
) -> NDArray:
    needed = of_part * parts
    held = os.fstat(file.fileno()).st_size - begin
    skip = held - needed if skip < 0 else skip
    if held - skip - needed in (1, 2):  # a line break after the last sample, as of text editors and printf
        file.seek(begin + skip + needed)
        rest = file.read(2)
        held -= len(rest) if rest in (b"\n", b"\r\n") else 0
    if skip < 0 or held - skip != needed:
        raise _wrong_size(what, max(held - max(skip, 0), 0), needed)
    file.seek(begin + skip + part * of_part)
    values = np.fromfile(file, dtype, of_part // dtype.itemsize)
    if values.nbytes != of_part:
        raise _wrong_size(what, values.nbytes, of_part)
    return native(values).reshape(sizes)


def _read_packed(
    blocks: Iterator[bytes], dtype: np.dtype, sizes: Sequence[int], needed: int, skip: int, what: str
) -> NDArray:
    values = np.empty(tuple(sizes), dtype)
    target = values.reshape(-1).view(np.uint8)
    seen = 0  # bytes unpacked so far, the skipped ones included
    for block in blocks:
        first = max(skip - seen, 0)
        at = max(seen - skip, 0)
        seen += len(block)
        if seen - skip > needed:
            raise _wrong_size(what, None, needed)
        target[at : at + max(len(block) - first, 0)] = np.frombuffer(block, np.uint8)[first:]
    if seen - skip != needed:
        raise _wrong_size(what, max(seen - skip, 0), needed)
    return native(values)


def _read_text(file: IO[bytes], dtype: np.dtype, sizes: Sequence[int], encoding: str, what: str) -> NDArray:
    count = prod(sizes)
    if (os.fstat(file.fileno()).st_size - file.tell()) < count:
        raise FileFault(f"{what} is too short to hold {count} samples as text")
    check_size(sizes, WORD_BYTES)
    text = file.read().decode("ascii")
    if encoding == "hex":
        values = np.frombuffer(bytes.fromhex(text), np.uint8)
        needed = count * dtype.itemsize
        if values.size != needed:
            raise FileFault(f"{what} must hold {needed} bytes of samples by its header, got {values.size}")
        return values.view(dtype).reshape(sizes)
    words = text.split()
    if len(words) != count:
        raise FileFault(f"{what} must hold {count} numbers by its header, got {len(words)}")
    return from_words(words, dtype).reshape(sizes)


def from_words(words: Sequence[str], dtype: np.dtype) -> NDArray:
    """Return numbers written as text; whole numbers by Python's, so that 300 is no uint8 and does not become 44."""
    return np.array(words if dtype.kind == "f" else [int(word) for word in words], dtype)


def _wrong_size(what: str, held: int | None, needed: int) -> FileFault:
    held_text = f"more than {needed}" if held is None else f"{held}"
    return FileFault(f"{what} holds {held_text} bytes of samples, but the header's dimensions and type need {needed}")


def unpacked(file: IO[bytes], encoding: str) -> Iterator[bytes]:
    """Yield the content of a compressed stream in blocks of bounded size; checksums are verified at its end.

    Consecutive streams count as one; padding after them is ignored.
    """
    make = bz2.BZ2Decompressor if encoding == "bzip2" else lambda: zlib.decompressobj(zlib.MAX_WBITS | 32)
    magic = b"BZh" if encoding == "bzip2" else b"\x1f\x8b"
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
        if len(pending) < len(magic):
            pending += file.read(_PIECE)
        if not pending.startswith(magic):
            return


def _bounded(blocks: Iterator[bytes], limit: int, what: str) -> Iterator[bytes]:
    seen = 0
    for block in blocks:
        seen += len(block)
        if seen > limit:
            raise FileFault(f"{what} unpacks to more than {in_bytes(limit)}, but the header's dimensions need less")
        yield block


def _skip_lines(file: IO[bytes], count: int, what: str) -> None:
    """Skip so many lines; raise FileFault if there are fewer."""
    held = os.fstat(file.fileno()).st_size
    for number in range(count):
        if file.tell() >= held:
            raise FileFault(f"the header skips {count} lines, but {what} holds {number}")
        while (piece := file.readline(_BLOCK)) and not piece.endswith(b"\n"):
            pass


def data_files(header_path: str, named: str, listed: Sequence[str] | None) -> list[tuple[str, str]]:
    """Return the names of data files in a header, and their paths.

    Parameters
    ----------
    named : str
        Field of the header: a name, or a pattern as for `_numbered_names`, which NRRD lets a dimension follow.
    listed : sequence of str, optional
        Names if the header lists them.

    Raises
    ------
    FileFault
        If a file does not exist, or is not in the header's folder or below.
    """
    words = named.split()
    if listed is not None:
        names = list(listed)
    elif len(words) in (4, 5) and "%" in words[0]:
        names = _numbered_names(words[:4])
    else:
        names = [named]
    return [(name, _data_file(header_path, name)) for name in names]


def read_files(
    files: Sequence[tuple[str, str]],
    dtype: np.dtype,
    sizes: Sequence[int],
    index: Sequence[int | slice],
    choice: Choice,
    **where: Any,
) -> NDArray:
    """Return the samples at `index` from data files that hold equal parts; other arguments as for `read_stored`."""
    if len(files) == 1:
        [(name, path)] = files
        return read_picked(path, dtype, sizes, index, choice, what=f"its data file {name}", **where)

    def of_all_files() -> NDArray:
        check_size(sizes, dtype.itemsize)
        values = np.empty((len(files), prod(sizes) // len(files)), dtype)
        for (name, path), slot in zip(files, values, strict=True):
            slot[...] = read_stored(path, dtype, slot.shape, what=f"its data file {name}", **where)
        return values.reshape(sizes)

    return once(choice, "data files", of_all_files)[tuple(index)]


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
