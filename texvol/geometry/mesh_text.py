"""Mesh files of text, normalised and checked against their own counts before trimesh reads them.

trimesh silently skips what it does not understand: lines that begin with a space, faces with too few corners, and
indices that count back from a vertex in the middle of the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from texvol.formats.readers.samples import FileFault

# OBJ: keywords that begin a line; faces with an index 0, with fewer than three corners, with negative indices.
_KEYWORDS = re.compile(rb"^[ \t]*(v|vn|vt|f|o|g|s|usemtl)[ \t]+", re.MULTILINE)
_COMMENTS = re.compile(rb"#[^\n]*")
_WITH_ZERO = re.compile(rb"^f [^\n]*?(?<=[ \t/])0+(?=[ \t/\n]|\Z)", re.MULTILINE)
_WITH_FEW = re.compile(rb"^f(?:[ \t]+[^ \t\n]+){0,2}[ \t]*$", re.MULTILINE)
_FROM_BEHIND = re.compile(rb"^f [^\n]*?(?<=[ \t/])-\d", re.MULTILINE)
_FACES = re.compile(rb"^f ([^\n]*)", re.MULTILINE)

# PLY: a property is a list or a single number.
_LIST, _SCALAR = -1, 1


def plain_obj(content: bytes) -> tuple[str, int]:
    """Return the text of an OBJ file in a form that trimesh reads, and the number of triangles of its faces.

    Raises
    ------
    FileFault
        If a face has fewer than three corners, an index 0, or one of more digits than there are elements.
    """
    content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
    content = _KEYWORDS.sub(rb"\1 ", _COMMENTS.sub(b"", content))
    for wrong, reason in (
        (_WITH_ZERO, "index 0, but OBJ counts from 1"),
        (_WITH_FEW, "fewer than three corners"),
    ):
        if found := wrong.search(content):
            line = content.count(b"\n", 0, found.start()) + 1
            raise FileFault(f"has a face with {reason}, in line {line}: {_shown(found.group())}")
    if _FROM_BEHIND.search(content):
        content = b"\n".join(_counted_from_1(content.split(b"\n")))
    _check_indices(content)
    triangles = sum(len(corners.split()) - 2 for corners in _FACES.findall(content))
    # Names may have any encoding, and are not used.
    return content.decode("utf-8", "replace"), triangles


def _check_indices(content: bytes) -> None:
    """Raise FileFault if an index has more digits than the number of elements: trimesh makes a table up to it."""
    most = max(
        content.count(f"\n{word} ".encode()) + content.startswith(f"{word} ".encode()) for word in ("v", "vt", "vn")
    )
    too_long = re.compile(rb"^f [^\n]*?(?<=[ \t/])0*([1-9]\d{%d,})" % len(str(most)), re.MULTILINE)
    if found := too_long.search(content):
        raise FileFault(f"has a face with index {_shown(found[1])}, where there are {most} at most to count")


def _counted_from_1(lines: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the lines, with negative indices of faces replaced by absolute ones."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    for line in lines:
        word = line.partition(b" ")[0]
        if word in counts:
            counts[word] += 1
        if word == b"f":
            corners = (corner.split(b"/") for corner in line.split()[1:])
            plain = [b"/".join(map(_absolute, corner, counts.values())) for corner in corners]
            line = b" ".join([b"f", *plain])
        yield line


def _absolute(index: bytes, count: int) -> bytes:
    if not index.startswith(b"-"):
        return index
    number = int(index) + count + 1
    if number < 1:
        raise FileFault(f"has a face with index {int(index)}, where there are {count} to count back from")
    return str(number).encode()


def plain_stl(lines: Iterable[bytes]) -> bytes:
    """Return the text of an STL file without the names of its solids; `lines` are in lower case.

    Raises
    ------
    FileFault
        If a facet does not have three vertices.
    """
    plain, facets, vertices = [], 0, 0
    for line in lines:
        words = line.split()
        word = words[0] if words else b""
        if word in (b"facet", b"endsolid") and vertices != 3 * facets:
            raise FileFault(f"has a facet, number {facets}, that has not three vertices")
        facets += word == b"facet"
        vertices += word == b"vertex"
        plain.append(word if word in (b"solid", b"endsolid") else b" ".join(words))
    return b"\n".join(plain) + b"\n"


def plain_ply(content: bytes) -> bytes:
    """Return a PLY file without the comments of its header.

    Raises
    ------
    FileFault
        If the file is text, and an element has more or fewer numbers than declared.
    """
    end = re.search(rb"^end_header[ \t]*\r?\n", content, re.MULTILINE)
    if end is None:
        raise FileFault("is truncated: its header does not end")
    header = [line.strip() for line in content[: end.start()].splitlines()]
    header = [line for line in header if line and line.split()[0] not in (b"comment", b"obj_info")]
    if any(line.split()[:2] == [b"format", b"ascii"] for line in header):
        _check_rows(header, content[end.end() :].splitlines())
    return b"\n".join([*header, b"end_header\n"]) + content[end.end() :]


def _check_rows(header: Iterable[bytes], rows: list[bytes]) -> None:
    """Raise FileFault unless each element's row has the numbers of its properties and lists."""
    at = 0
    for name, count, properties in _elements(header):
        for number, row in enumerate(rows[at : at + count]):
            words = row.split()
            if not _fits(words, properties):
                raise FileFault(f"has element {name} {number} with more or fewer numbers than declared: {_shown(row)}")
        at += count


def _elements(header: Iterable[bytes]) -> list[tuple[str, int, list[int]]]:
    """Return name, count and properties of each kind of element."""
    found: list[tuple[str, int, list[int]]] = []
    for line in header:
        words = line.split()
        if words[0] == b"element" and len(words) == 3:
            found.append((words[1].decode("utf-8", "replace"), int(words[2]), []))
        elif words[0] == b"property" and found:
            found[-1][2].append(_LIST if words[1:2] == [b"list"] else _SCALAR)
    return found


def _fits(words: list[bytes], properties: Iterable[int]) -> bool:
    at = 0
    for kind in properties:
        if at >= len(words):
            return False
        at += 1 if kind == _SCALAR else 1 + int(words[at])
    return at == len(words)


def _shown(line: bytes) -> str:
    return repr(line[:60].decode("utf-8", "replace"))
