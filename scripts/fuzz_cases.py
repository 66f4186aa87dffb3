"""Files made by hand for `fuzz.py`: bombs, loops, and numbers that mean no harm only if they are checked."""

from __future__ import annotations

from collections.abc import Iterator

from fuzz_seeds import Seed


def cases() -> list[Seed]:
    """All of them."""
    return [*_nrrd()]


def _nrrd() -> Iterator[Seed]:
    head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\n"
    yield Seed("nrrd", {"v.nrrd": f"{head}line skip: 1000000000000\n\n".encode() + bytes(120)}, "v.nrrd")
    yield Seed("nrrd", {"v.nhdr": f"{head}data file: f%099999d.raw 0 2 1\n\n".encode()}, "v.nhdr")
