"""Arrays of VTK's XML files.

An array of bytes begins with its length; a compressed one with the number of its blocks, the size of each, the size of
the last if it is smaller, and the compressed size of each. In base64 the lengths and the bytes may be one run or two.
"""

from __future__ import annotations

import binascii
import os
import re
import zlib
from math import prod
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault, check_size
from texvol.formats.readers.stored import WORD_BYTES, from_words
from texvol.util.errors import missing_extra

_TYPES = {"Int8": "i1", "Int16": "i2", "Int32": "i4", "Int64": "i8", "Float32": "f4", "Float64": "f8"}
_TYPES |= {"UInt8": "u1", "UInt16": "u2", "UInt32": "u4", "UInt64": "u8"}


class Appended(NamedTuple):
    """Data after the XML: the file, their first byte, and True for bytes or False for base64."""

    path: str
    begin: int
    is_raw: bool


class _Raw:
    """Bytes of a file."""

    def __init__(self, where: Appended, offset: int) -> None:
        self.path, self.at = where.path, where.begin + offset

    def take(self, count: int) -> bytes:
        """Return exactly the next `count` bytes."""
        with open(self.path, "rb") as file:
            if not 0 <= count <= os.fstat(file.fileno()).st_size - self.at:
                raise FileFault("is truncated: its array is longer than the file")
            file.seek(self.at)
            self.at += count
            return file.read(count)


class _Base64:
    """Runs of base64; bytes that are decoded before they are taken are kept, unless padding ends their run."""

    def __init__(self, text: bytes, at: int = 0) -> None:
        self.text, self.at, self.rest = memoryview(text), at, b""

    def take(self, count: int) -> bytes:
        """Return exactly the next `count` bytes."""
        length = (max(count - len(self.rest), 0) + 2) // 3 * 4
        chars = self.text[self.at : self.at + length]
        if len(chars) != length:
            raise FileFault("is truncated: its array is shorter than its length says")
        self.at += length
        content = self.rest + binascii.a2b_base64(chars)
        self.rest = content[count:]
        return content[:count]


class Document(NamedTuple):
    """VTK XML file: its root, the element of its data, and the location of appended data."""

    root: Element
    data: Element
    appended: Appended | None

    @property
    def byte_order(self) -> str:
        """Order of bytes in numpy's notation."""
        return ">" if self.root.get("byte_order") == "BigEndian" else "<"

    def type_of(self, array: Element) -> tuple[np.dtype, int]:
        """Return type and number of components of an array."""
        code = _TYPES.get(array.get("type", ""))
        if code is None:
            raise FileFault(f"its array {array.get('Name')!r} must hold numbers, got type {array.get('type')}")
        return np.dtype(self.byte_order + code), int(array.get("NumberOfComponents", 1))

    def array(self, array: Element, sizes: list[int], what: str = "") -> NDArray:
        """Return the samples of an array, shape `sizes`; with `what`, its name, the last size is that of components.

        Raises
        ------
        FileFault
            If it holds fewer or more samples, or has other components.
        """
        dtype, components = self.type_of(array)
        check_size(sizes, dtype.itemsize)
        if what and components != sizes[-1]:
            raise FileFault(f"its {what} must have {sizes[-1]} components, got {components}")
        needed = prod(sizes) * dtype.itemsize
        form = array.get("format", "ascii")
        if form == "ascii":
            check_size(sizes, WORD_BYTES)
            words = (array.text or "").split()
            if len(words) != prod(sizes):
                raise FileFault(f"its array holds {len(words)} numbers, but its extent needs {prod(sizes)}")
            return from_words(words, dtype).reshape(sizes)
        word = np.dtype(self.byte_order + ("u8" if self.root.get("header_type") == "UInt64" else "u4"))
        run = _run(array, form, self.appended)
        if packer := self.root.get("compressor"):
            return _from_blocks(run, packer, word, needed).view(dtype).reshape(sizes)
        held = int(np.frombuffer(run.take(word.itemsize), word)[0])
        if held != needed:
            raise _wrong_size(held, needed)
        return np.frombuffer(run.take(needed), dtype).reshape(sizes)


def _run(array: Element, form: str, appended: Appended | None) -> _Raw | _Base64:
    if form == "binary":
        text = (array.text or "").strip().encode("ascii")
        # Joined only where something stands between, as a copy may be as large as the volume.
        return _Base64(b"".join(text.split()) if re.search(rb"\s", text) else text)
    offset = int(array.get("offset", 0))
    if form != "appended" or appended is None or offset < 0:
        raise FileFault(f"its array {array.get('Name')!r} has format {form!r} and no data")
    if appended.is_raw:
        return _Raw(appended, offset)
    with open(appended.path, "rb") as file:
        file.seek(appended.begin)
        return _Base64(file.read(), offset)


def _from_blocks(run: _Raw | _Base64, packer: str, word: np.dtype, needed: int) -> NDArray[np.uint8]:
    """Return the bytes of a compressed array, after comparing its lengths with `needed`."""
    blocks, size, last = (int(number) for number in np.frombuffer(run.take(3 * word.itemsize), word))
    total = (blocks - 1) * size + last if last else blocks * size
    if total != needed or blocks > needed:
        raise _wrong_size(total, needed)
    lengths = [int(number) for number in np.frombuffer(run.take(blocks * word.itemsize), word)]
    data = run.take(sum(lengths))
    values = np.empty(needed, np.uint8)
    at = begin = 0
    for length in lengths:
        wanted = min(size, needed - begin)
        block = _unpacked(data[at : at + length], packer, wanted)
        if len(block) != wanted:
            raise FileFault(f"is corrupt: a block of its array unpacks to {len(block)} bytes of {wanted}")
        values[begin : begin + wanted] = np.frombuffer(block, np.uint8)
        at, begin = at + length, begin + wanted
    return values


def _unpacked(block: bytes, packer: str, wanted: int) -> bytes:
    """Return the content of a block, at most one byte more than expected."""
    if packer == "vtkZLibDataCompressor":
        return zlib.decompressobj().decompress(block, wanted + 1)
    if packer == "vtkLZMADataCompressor":
        import lzma

        return lzma.LZMADecompressor(memlimit=2**28).decompress(block, wanted + 1)
    if packer == "vtkLZ4DataCompressor":
        try:
            import imagecodecs
        except ImportError as error:
            raise missing_extra("imagecodecs", "formats", "reading a VTI file packed by LZ4") from error
        return bytes(imagecodecs.lz4_decode(block, out=wanted))
    raise FileFault(f"is compressed by {packer}, which texvol does not read; it reads zlib, LZMA and LZ4")


def _wrong_size(held: int, needed: int) -> FileFault:
    return FileFault(f"its array holds {held} bytes of samples, and its extent and type need {needed}")
