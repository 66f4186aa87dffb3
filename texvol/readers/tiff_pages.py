"""The chain of a TIFF's pages: each says where the next one is, the last one 0.

Held against the file before tifffile reads it, which on a broken chain takes the pages before the break for all.
"""

from __future__ import annotations

import os
import struct

from texvol.readers.samples import FileFault


def check_pages(path: str) -> None:
    """Raise FileFault unless the chain of pages ends, within the file."""
    with open(path, "rb") as file:
        held = os.fstat(file.fileno()).st_size
        head = file.read(16)
        order = "<" if head[:2] == b"II" else ">"
        is_big = len(head) >= 4 and struct.unpack(order + "H", head[2:4])[0] == 43
        # BigTIFF counts a page's fields in 8 bytes, each of 20; the classic one in 2 bytes, each of 12.
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
                raise FileFault(f"is corrupt: page {len(seen)} is followed by one before it")
            if at + count_bytes > held:
                raise FileFault(f"is truncated: page {len(seen)} begins at byte {at} of {held}")
            seen.add(at)
            file.seek(at)
            fields = struct.unpack(count_form, file.read(count_bytes))[0]
            end = at + count_bytes + fields * field_bytes
            if end + next_bytes > held:
                raise FileFault(f"is truncated: page {len(seen) - 1} describes itself up to byte {end} of {held}")
            file.seek(end)
            at = struct.unpack(next_form, file.read(next_bytes))[0]
        if not seen:
            raise FileFault("holds no page")
