"""Checks of netCDF files before the netCDF library opens them: some damaged files make it loop forever.

The header of a classic file is a list of dimensions, of attributes and of variables, each with its count. The library
trusts counts that a damaged header makes large, and reads zeros beyond the end of a truncated file. Both are compared
with the file first. For netCDF-4, which is HDF5, the heaps are checked.
"""

from __future__ import annotations

import mmap
import os
import struct
from math import prod
from typing import IO

from texvol.formats.readers.samples import FileFault

_ITEM_BYTES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 4, 6: 8, 7: 1, 8: 2, 9: 4, 10: 8, 11: 8}  # by the format's type number
_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12  # marks of the lists
_HEAP = b"GCOL\x01\0\0\0"  # begins a global heap of HDF5, version 1
_MOST_SEARCHED = 2**30  # bytes
_MOST_DIMENSIONS = 1024  # of a variable: NC_MAX_VAR_DIMS


def check_classic(path: str) -> None:
    """Raise FileFault unless the header is complete and its samples are within the file."""
    with open(path, "rb") as file:
        _Header(file).check()


class _Header:
    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._held = os.fstat(file.fileno()).st_size
        version = self._take(4)[3]
        # Version 5 counts in 8 bytes; 2 has offsets of 8.
        self._count_form, self._offset_form = (">Q" if version == 5 else ">I"), (">I" if version == 1 else ">Q")

    def check(self) -> None:
        records = self._count()
        unknown = 2 ** (8 * struct.calcsize(self._count_form)) - 1  # written by a program that could not seek back
        lengths = []
        for _ in range(self._list(_DIMENSIONS)):
            self._name()
            lengths.append(self._count())
        self._attributes()
        ends, sizes, begins = [0], [], []
        for _ in range(self._list(_VARIABLES)):
            self._name()
            count = self._count()
            if count > _MOST_DIMENSIONS:
                raise FileFault(f"is corrupt: its header has a variable of {count} dimensions")
            numbers = [self._count() for _ in range(count)]
            if any(number >= len(lengths) for number in numbers):
                raise FileFault("is corrupt: its header has a variable along an unknown dimension")
            self._attributes()
            item = self._item_bytes()
            self._count()  # the size, which overflows for large variables and follows from the rest
            begin = self._number(self._offset_form)
            is_record = bool(numbers) and lengths[numbers[0]] == 0
            size = item * prod(lengths[number] for number in numbers[1 if is_record else 0 :])
            if is_record:
                begins.append(begin)
                sizes.append(size)
            else:
                ends.append(begin + size)
        # A record aligns each variable to 4 bytes, unless there is only one.
        record_bytes = sizes[0] if len(sizes) == 1 else sum(size + -size % 4 for size in sizes)
        if records and records != unknown:
            ends += [begin + (records - 1) * record_bytes + size for begin, size in zip(begins, sizes, strict=True)]
        if max(ends) > self._held:
            raise FileFault(f"is truncated: its samples end at byte {max(ends)} of {self._held}")

    def _take(self, count: int) -> bytes:
        data = self._file.read(count) if 0 <= count <= self._held else b""
        if len(data) != count:
            raise FileFault("is truncated or corrupt: its header goes beyond the end of the file")
        return data

    def _number(self, form: str) -> int:
        return int(struct.unpack(form, self._take(struct.calcsize(form)))[0])

    def _count(self) -> int:
        return self._number(self._count_form)

    def _name(self) -> None:
        length = self._count()
        self._take(length + -length % 4)

    def _list(self, mark: int) -> int:
        """Return the number of elements of a list; each takes at least 4 bytes, which bounds the number."""
        found, count = self._number(">I"), self._count()
        if found != mark and (found or count):
            raise FileFault(f"is corrupt: its header has mark {found} where a list of mark {mark} begins")
        if count * 4 > self._held:
            raise FileFault(f"is corrupt: its header has a list of {count} elements in a file of {self._held} bytes")
        return count

    def _item_bytes(self) -> int:
        number = self._number(">I")
        if number not in _ITEM_BYTES:
            raise FileFault(f"is corrupt: its header has the unknown type {number}")
        return _ITEM_BYTES[number]

    def _attributes(self) -> None:
        for _ in range(self._list(_ATTRIBUTES)):
            self._name()
            size = self._item_bytes() * self._count()
            self._take(size + -size % 4)


def check_heaps(path: str) -> None:
    """Raise FileFault if a heap of an HDF5 file has an object without a size, on which the HDF5 library loops forever.

    Files too large to be searched quickly are not checked.
    """
    with open(path, "rb") as file:
        held = os.fstat(file.fileno()).st_size
        if held > _MOST_SEARCHED:
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            at = content.find(_HEAP)
            while at >= 0:
                _check_heap(content, at, held)
                at = content.find(_HEAP, at + len(_HEAP))


def _check_heap(content: mmap.mmap, begin: int, held: int) -> None:
    """Check a collection of objects, each with an index (0 for free space) and a size; III.E of the format."""
    head = content[begin : begin + 16]
    size = int.from_bytes(head[8:16], "little")
    if len(head) < 16 or not 16 < size <= held - begin:
        return  # not a heap, or one that the library rejects
    at = begin + 16
    while at + 16 <= begin + size:
        number, length = int.from_bytes(content[at : at + 2], "little"), content[at + 8 : at + 16]
        room = int.from_bytes(length, "little")
        if number == 0 and room == 0:
            raise FileFault(f"is corrupt: its heap at byte {begin} has free space of no size")
        at += room if number == 0 else 16 + room + -room % 8
