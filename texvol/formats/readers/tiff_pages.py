"""Checks of a TIFF's chain of pages, and of OME's description of them, before tifffile reads the file.

Each page has the offset of the next one, and the last page 0; on a broken chain tifffile returns the pages before the
break without an error. It makes a list of OME's planes as long as the description says.
"""

from __future__ import annotations

import os
import re
import struct
from math import prod

from texvol.formats.readers.samples import FileFault

# Bytes of a page that is too small to be plausible, and how many such pages are accepted.
_TINY, _MOST_TINY_PAGES = 2**11, 2**15
# Planes in OME's description per page of the file, since recordings may be incomplete; and the number always accepted.
_PLANES_A_PAGE, _PLANES_ANYWAY = 100, 2**12


def check_planes(ome: str, pages: int) -> None:
    """Raise FileFault if OME's description has far more planes than the file has pages."""
    told = 0
    for pixels in re.findall(r"<(?:\w+:)?Pixels\b([^>]*)>", ome):
        told += prod(_whole(pixels, f"Size{axis}") for axis in "ZCT")
    for entry in re.findall(r"<(?:\w+:)?TiffData\b([^>]*)>", ome):
        told += _whole(entry, "PlaneCount")
    if told > max(_PLANES_A_PAGE * pages, _PLANES_ANYWAY):
        raise FileFault(f"its OME description has {told} planes, but the file has {pages} pages")


def _whole(attributes: str, name: str) -> int:
    found = re.search(rf'\b{name}\s*=\s*["\'](\d{{1,18}})["\']', attributes)
    return int(found.group(1)) if found else 1


def check_pages(path: str) -> None:
    """Raise FileFault unless the chain of pages ends, within the file."""
    with open(path, "rb") as file:
        held = os.fstat(file.fileno()).st_size
        head = file.read(16)
        order = "<" if head[:2] == b"II" else ">"
        is_big = len(head) >= 4 and struct.unpack(order + "H", head[2:4])[0] == 43
        # BigTIFF counts a page's fields in 8 bytes, with 20 per field; classic TIFF in 2 bytes, with 12.
        count_form, count_bytes, field_bytes, next_form, next_bytes = (
            (order + "Q", 8, 20, order + "Q", 8) if is_big else (order + "H", 2, 12, order + "I", 4)
        )
        begin = 8 if is_big else 4
        if len(head) < begin + next_bytes:
            raise FileFault("is truncated: it ends within its header")
        at = struct.unpack(next_form, head[begin : begin + next_bytes])[0]
        seen: set[int] = set()
        while at:
            if at in seen:
                raise FileFault(f"is corrupt: page {len(seen)} is followed by an earlier page")
            if at + count_bytes > held:
                raise FileFault(f"is truncated: page {len(seen)} begins at byte {at} of {held}")
            seen.add(at)
            if len(seen) > _MOST_TINY_PAGES and len(seen) * _TINY > held:
                raise FileFault(f"has more than {_MOST_TINY_PAGES} pages of less than {_TINY} bytes each")
            file.seek(at)
            fields = struct.unpack(count_form, file.read(count_bytes))[0]
            end = at + count_bytes + fields * field_bytes
            if end + next_bytes > held:
                raise FileFault(f"is truncated: page {len(seen) - 1} describes itself up to byte {end} of {held}")
            file.seek(end)
            at = struct.unpack(next_form, file.read(next_bytes))[0]
        if not seen:
            raise FileFault("has no page")
