"""PNGs that are packed quickly hold what OpenImageIO's own hold, with and without the library that packs them."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.picture_files import header

from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image, quick_png

TEXTS = {"texvol:scene": '{"volume": "Schädel", "n": 1}', "texvol:renderer": "a\nb", "Software": "texvol"}


@pytest.fixture(params=["isal", "zlib"])
def packer(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The library that packs is there, or it is not."""
    if request.param == "isal":
        pytest.importorskip("isal")
    else:
        monkeypatch.setitem(sys.modules, "isal.isal_zlib", None)
        monkeypatch.setitem(sys.modules, "isal", None)
    quick_png._deflate.cache_clear()
    assert (quick_png._deflate() is zlib) == (request.param == "zlib")
    yield
    quick_png._deflate.cache_clear()


def picture(height: int, width: int) -> np.ndarray:
    random = np.random.default_rng(height)
    opacity = np.rint(random.random((height, width, 1)) * 4) / 4
    return np.concatenate([random.random((height, width, 3)) * opacity, opacity], axis=2).astype(np.float32)


@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("size", [(1, 1), (1, 7), (9, 1), (37, 53)])
def test_a_quick_png_has_the_same_pixels_and_header(
    tmp_path: Path, packer: None, size: tuple[int, int], transparent: bool
) -> None:
    drawn = picture(*size)
    paths = [tmp_path / "usual.png", tmp_path / "quick.png"]
    for path in paths:
        path.write_bytes(image.encoded(path, drawn, TEXTS, transparent=transparent, quick=path.stem == "quick"))
    np.testing.assert_array_equal(image.read(paths[0]), image.read(paths[1]))
    assert header(paths[0]) == header(paths[1])
    assert header(paths[1]).items() >= TEXTS.items()
    usual, quick = (read_picture(path) for path in paths)
    np.testing.assert_array_equal(usual.pixels, quick.pixels)
    assert usual.attributes == quick.attributes


def test_each_picture_has_its_own_texts(tmp_path: Path) -> None:
    """What pictures have in common is made once; nothing of one may get into the next."""
    texts = [TEXTS, {"texvol:scene": "other"}, {"Software": "another"}, {}]
    for number, each in enumerate(texts):
        path = tmp_path / f"{number}.png"
        path.write_bytes(image.encoded(path, picture(3, 3), each, quick=True))
        found = read_picture(path).attributes
        assert {name: text for name, text in found.items() if name in TEXTS} == each


def test_every_part_has_its_checksum_and_pixels_are_packed(packer: None) -> None:
    """A picture of rows that are alike takes as good as no room: it is rows that are told apart."""
    rows = np.tile(picture(1, 500), (300, 1, 1))
    file = image.encoded("a.png", rows, TEXTS, quick=True)
    start, kinds = 8, []
    while start < len(file):
        length, kind = struct.unpack_from(">I4s", file, start)
        end = start + 8 + length
        assert struct.unpack_from(">I", file, end) == (zlib.crc32(file[start + 4 : end]),)
        kinds.append(kind)
        start = end + 4
    assert start == len(file) and kinds[0] == b"IHDR" and kinds[-1] == b"IEND" and kinds.count(b"IDAT") == 1
    assert len(file) < 500 * 3 + 300 * 10 + 1000  # the first row; a copy of at most 258 bytes takes some bits; texts
