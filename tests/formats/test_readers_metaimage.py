"""MetaImage, held against ITK: what SimpleITK writes is read, and lies where SimpleITK says."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK
from support import marked

from texvol import InputError, load

HEADER = "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = {msb}\nDimSize = 5 4 3\nElementType = {type}\n"
TYPES = {
    "i1": "MET_CHAR",
    "u1": "MET_UCHAR",
    "i2": "MET_SHORT",
    "u2": "MET_USHORT",
    "i4": "MET_INT",
    "u4": "MET_UINT",
    "i8": "MET_LONG_LONG",
    "u8": "MET_ULONG_LONG",
    "f4": "MET_FLOAT",
    "f8": "MET_DOUBLE",
}


def by_hand(path: Path, data: bytes, *fields: str, dtype: str = "<i2", where: str = "LOCAL") -> Path:
    """Write a header with further `fields`, and the samples after it."""
    text = HEADER.format(msb=dtype[0] == ">", type=TYPES[dtype[1:]])
    text += "".join(f"{field}\n" for field in (*fields, f"ElementDataFile = {where}"))
    path.write_bytes(text.encode() + data)
    return path


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("ending", [".mha", ".mhd"])
def test_what_itk_writes_lies_where_itk_says(tmp_path: Path, ending: str, packed: bool) -> None:
    image = SimpleITK.GetImageFromArray(marked.marked())
    image.SetSpacing(marked.SPACING)
    image.SetOrigin(marked.ORIGIN)
    image.SetDirection(marked.DIRECTION.ravel().tolist())
    path = tmp_path / f"v{ending}"
    SimpleITK.WriteImage(image, str(path), packed)
    volume = load(path)
    # ITK writes positions and directions with six digits or more.
    marked.check(volume, atol=1e-4)
    reread = SimpleITK.ReadImage(str(path))
    np.testing.assert_allclose(
        marked.found_mark(volume), reread.TransformIndexToPhysicalPoint(marked.MARK), rtol=0, atol=1e-9
    )
    assert (volume.unit, volume.space) == ("mm", "left-posterior-superior")


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("dtype", TYPES)
def test_every_type_and_byte_order(tmp_path: Path, dtype: str, order: str) -> None:
    path = by_hand(tmp_path / "v.mha", marked.marked(order + dtype).tobytes(), dtype=order + dtype)
    marked.check(load(path), dtype, position=marked.MARK)


def test_data_in_other_files(tmp_path: Path) -> None:
    data = marked.marked().tobytes()
    (tmp_path / "d.raw").write_bytes(b"header!" + data)
    marked.check(load(by_hand(tmp_path / "a.mhd", b"", "HeaderSize = 7", where="d.raw")), position=marked.MARK)
    marked.check(load(by_hand(tmp_path / "b.mhd", b"", "HeaderSize = -1", where="d.raw")), position=marked.MARK)
    (tmp_path / "d.zraw").write_bytes(zlib.compress(data))
    marked.check(load(by_hand(tmp_path / "c.mhd", b"", "CompressedData = True", where="d.zraw")), position=marked.MARK)
    for number, piece in enumerate(marked.marked()):
        (tmp_path / f"s{number}.raw").write_bytes(piece.tobytes())
    marked.check(load(by_hand(tmp_path / "e.mhd", b"s0.raw\ns1.raw\ns2.raw\n", where="LIST")), position=marked.MARK)
    marked.check(load(by_hand(tmp_path / "f.mhd", b"", where="s%d.raw 0 2 1")), position=marked.MARK)


def test_channels_and_time(tmp_path: Path) -> None:
    vectors = np.stack([marked.marked() * 0, marked.marked()], axis=3)
    path = by_hand(tmp_path / "v.mha", vectors.tobytes(), "ElementNumberOfChannels = 2")
    marked.check(load(path, channel=1), position=marked.MARK)
    with pytest.raises(InputError, match=r"--channel 0\.\.1"):
        load(path)
    path.write_bytes(
        b"ObjectType = Image\nNDims = 4\nDimSize = 5 4 3 2\nElementSpacing = 2 3 4 1\nElementType = MET_SHORT\n"
        b"ElementDataFile = LOCAL\n" + np.moveaxis(vectors, 3, 0).tobytes()
    )
    marked.check(load(path, time=1), position=np.multiply((2, 3, 4), marked.MARK))


@pytest.mark.parametrize(
    ("fields", "data", "reason"),
    [
        (("ElementSpacing = 1 -2 1",), bytes(120), "spacing must be positive"),
        (("ElementSpacing = 1 0 1",), bytes(120), "spacing must be positive"),
        (("ElementSpacing = 1 nan 1",), bytes(120), "spacing must be finite"),
        (("ElementSpacing = 1 1",), bytes(120), "ElementSpacing must be 3 numbers, got 2"),
        (("ElementSpacing = 1 x 1",), bytes(120), "must be numbers"),
        (("TransformMatrix = 1 0 0 1 0 0 0 0 1",), bytes(120), "singular"),
        (("TransformMatrix = 0 0 0 0 1 0 0 0 1",), bytes(120), "singular"),
        (("DimSize = 5 4",), bytes(120), "NDims"),
        (("DimSize = 5 4 0",), bytes(120), "positive"),
        (("DimSize = 99999 99999 99999",), bytes(120), "this machine has"),
        (("ElementType = MET_STRING",), bytes(120), "MET_STRING"),
        (("BinaryData = False",), bytes(120), "text"),
        (("CompressedData = True",), zlib.compress(bytes(120))[:-3], "truncated"),
        (("CompressedData = True",), zlib.compress(bytes(121)), "more than 120"),
        (("nonsense",), bytes(120), "not Key = value"),
        ((), bytes(119), "holds 119 bytes"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(
    tmp_path: Path, fields: tuple[str, ...], data: bytes, reason: str
) -> None:
    with pytest.raises(InputError, match=rf"v\.mha: .*{reason}"):
        load(by_hand(tmp_path / "v.mha", data, *fields))
