"""NRRD: encodings, skips, detached data, directions; written by pynrrd or by hand."""

from __future__ import annotations

import bz2
import gzip
from pathlib import Path

import nrrd
import numpy as np
import pytest
from support import marked

from texvol import InputError, load

TYPE_NAMES = {
    "i1": "int8",
    "u1": "unsigned char",
    "i2": "short",
    "u2": "uint16",
    "i4": "int",
    "u4": "unsigned int",
    "i8": "long long int",
    "u8": "uint64",
    "f4": "float",
    "f8": "double",
}
HEADER = "NRRD0004\ntype: {type}\ndimension: 3\nsizes: 5 4 3\nendian: {endian}\nencoding: {encoding}\n"


def by_hand(path: Path, data: bytes, *fields: str, dtype: str = "<i2", encoding: str = "raw") -> Path:
    """Write a header with further `fields`, and the samples after it."""
    endian = "big" if dtype[0] == ">" else "little"
    text = HEADER.format(type=TYPE_NAMES[dtype[1:]], endian=endian, encoding=encoding)
    path.write_bytes((text + "".join(f"{field}\n" for field in fields) + "\n").encode() + data)
    return path


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("dtype", TYPE_NAMES)
def test_every_type_and_byte_order(tmp_path: Path, dtype: str, order: str) -> None:
    path = by_hand(tmp_path / "v.nrrd", marked.marked(order + dtype).tobytes(), dtype=order + dtype)
    marked.check(load(path), dtype, position=marked.MARK)


@pytest.mark.parametrize("detached", [False, True])
@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii"])
def test_what_pynrrd_writes(tmp_path: Path, encoding: str, detached: bool) -> None:
    header = {
        "encoding": encoding,
        "space": "left-posterior-superior",
        "space origin": np.array(marked.ORIGIN),
        "space directions": (marked.DIRECTION * marked.SPACING).T,
        "space units": ["mm"] * 3,
    }
    path = tmp_path / ("v.nhdr" if detached else "v.nrrd")
    nrrd.write(str(path), marked.marked().T, header)
    volume = load(path)
    marked.check(volume)
    np.testing.assert_allclose(volume.spacing, marked.SPACING)
    np.testing.assert_allclose(volume.direction, marked.DIRECTION)
    assert (volume.space, volume.unit) == ("left-posterior-superior", "mm")


def test_short_names_of_spaces_become_long(tmp_path: Path) -> None:
    fields = ("space: RAS", "space directions: (1,0,0) (0,1,0) (0,0,1)")
    assert load(by_hand(tmp_path / "v.nrrd", marked.marked().tobytes(), *fields)).space == "right-anterior-superior"


def test_hexadecimal_samples(tmp_path: Path) -> None:
    data = marked.marked(">i2").tobytes().hex(" ", 10).encode()
    marked.check(load(by_hand(tmp_path / "v.nrrd", data, dtype=">i2", encoding="hex")), position=marked.MARK)


def test_skipped_lines_and_bytes(tmp_path: Path) -> None:
    """Lines are skipped in the file; bytes in what is unpacked from there on."""
    data = marked.marked().tobytes()
    raw = by_hand(tmp_path / "a.nrrd", b"one\ntwo\n1234567" + data, "line skip: 2", "byte skip: 7")
    packed = by_hand(
        tmp_path / "b.nrrd",
        b"one\ntwo\n" + gzip.compress(b"1234567" + data),
        "lineskip: 2",
        "byteskip: 7",
        encoding="gz",
    )
    last = by_hand(tmp_path / "c.nrrd", b"whatever" + data, "byte skip: -1")
    last_packed = by_hand(tmp_path / "d.nrrd", bz2.compress(b"whatever" + data), "byte skip: -1", encoding="bz2")
    for path in (raw, packed, last, last_packed):
        marked.check(load(path), position=marked.MARK)


def test_several_data_files(tmp_path: Path) -> None:
    for number, piece in enumerate(marked.marked()):
        (tmp_path / f"slice{number:02}.raw").write_bytes(piece.tobytes())
    names = "".join(f"slice{number:02}.raw\n" for number in range(3))
    text = HEADER.format(type="short", endian="little", encoding="raw")
    (tmp_path / "list.nhdr").write_text(text + "data file: LIST\n" + names)
    (tmp_path / "pattern.nhdr").write_text(text + "data file: slice%02d.raw 0 2 1\n")
    (tmp_path / "back.nhdr").write_text(text + "data file: slice%02d.raw 2 0 -1\n")
    marked.check(load(tmp_path / "list.nhdr"), position=marked.MARK)
    marked.check(load(tmp_path / "pattern.nhdr"), position=marked.MARK)
    np.testing.assert_array_equal(load(tmp_path / "back.nhdr").values, marked.marked()[::-1])


@pytest.mark.parametrize("spacing", ["-3", "nan", "0", "inf"])
def test_a_spacing_that_is_none_is_refused_unless_another_is_given(tmp_path: Path, spacing: str) -> None:
    """An axis runs backwards by its direction, and an unknown spacing is left out."""
    path = by_hand(tmp_path / "v.nrrd", marked.marked().tobytes(), f"spacings: 2 {spacing} 4")
    with pytest.raises(InputError, match=r"v\.nrrd: .*spacing"):
        load(path)
    np.testing.assert_array_equal(load(path, spacing=(2, 3, 4)).spacing, [2, 3, 4])


def test_axis_mins_of_cells_lie_half_a_sample_before_the_first(tmp_path: Path) -> None:
    fields = ("spacings: 2 3 4", "axis mins: 0 0 0", "centerings: cell node cell")
    volume = load(by_hand(tmp_path / "v.nrrd", marked.marked().tobytes(), *fields))
    np.testing.assert_array_equal(volume.origin, [1, 0, 2])


@pytest.mark.parametrize("where", [0, 3])
def test_a_channel_axis_is_known_by_its_direction_or_kind(tmp_path: Path, where: int) -> None:
    values = np.stack([np.zeros_like(marked.marked()), marked.marked()], axis=3 - where)
    vectors, kinds = ["(2,0,0)", "(0,3,0)", "(0,0,4)"], ["space"] * 3
    vectors.insert(where, "none")
    kinds.insert(where, "vector")
    text = "NRRD0004\ntype: short\ndimension: 4\nsizes: {}\nendian: little\nencoding: raw\n"
    text = text.format(" ".join(map(str, values.shape[::-1])))
    for name, fields in {
        "a": f"space dimension: 3\nspace directions: {' '.join(vectors)}\n",
        "b": f"kinds: {' '.join(kinds)}\nspacings: {'nan 2 3 4' if where == 0 else '2 3 4 nan'}\n",
    }.items():
        path = tmp_path / f"{name}.nrrd"
        path.write_bytes((text + fields + "\n").encode() + values.tobytes())
        marked.check(load(path, channel=1), position=np.multiply((2, 3, 4), marked.MARK))
        if name == "a":  # not called a vector
            with pytest.raises(InputError, match=r"--channel 0\.\.1"):
                load(path)
        else:
            assert [each.number for each in load(path).channels] == [0, 1] and not load(path).values.any()
    path.write_bytes((text.replace("short", "float") + fields + "\n").encode() + values.astype("<f4").tobytes())
    with pytest.raises(InputError, match=r"--channel 0\.\.1.*--channel magnitude"):
        load(path)


def test_a_time_axis_is_picked_by_time(tmp_path: Path) -> None:
    values = np.stack([np.zeros_like(marked.marked()), marked.marked()])
    text = "NRRD0004\ntype: short\ndimension: 4\nsizes: 5 4 3 2\nendian: little\nencoding: raw\n"
    (tmp_path / "v.nrrd").write_bytes((text + "kinds: space space space time\n\n").encode() + values.tobytes())
    marked.check(load(tmp_path / "v.nrrd", time=1), position=marked.MARK)
    with pytest.raises(InputError, match=r"--time 0\.\.1"):
        load(tmp_path / "v.nrrd")


@pytest.mark.parametrize(
    ("fields", "encoding", "data", "reason"),
    [
        (("byte skip: -2",), "raw", b"", "byte skip"),
        (("line skip: -1",), "raw", b"", "line skip"),
        ((), "quilt", b"", "encoding must be raw, gzip, bzip2, ascii or hex, got quilt"),
        ((), "raw", bytes(119), "holds 119 bytes of samples, .* need 120"),
        ((), "raw", bytes(130), "holds 130 bytes"),
        ((), "gzip", gzip.compress(bytes(119), mtime=0), "holds 119 bytes"),
        ((), "gzip", gzip.compress(bytes(121), mtime=0), "more than 120"),
        ((), "gzip", gzip.compress(bytes(120), mtime=0)[:-9], "truncated"),
        ((), "bzip2", bz2.compress(bytes(120))[:-9], "truncated"),
        ((), "gzip", bytes(120), "while decompressing"),
        ((), "ascii", b"1 2 3" * 60, "numbers"),
        ((), "ascii", b"70000 " * 60, "70000"),
        (("space directions: (1,0,0) (2,0,0) (0,0,1)",), "raw", bytes(120), "singular"),
        (("space directions: (1,0,0) (0,0,0) (0,0,1)",), "raw", bytes(120), "singular"),
        (("space directions: (1,0,0) (0,inf,0) (0,0,1)",), "raw", bytes(120), "finite"),
        (("space directions: (1,0,0) (0,1,0) none",), "raw", bytes(120), "finite"),
        (("spacings: 1 0 1",), "raw", bytes(120), "spacing"),
        (("spacings: 1 inf 1",), "raw", bytes(120), "spacing"),
        (("no field at all",), "raw", bytes(120), "neither field nor comment"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(
    tmp_path: Path, fields: tuple[str, ...], encoding: str, data: bytes, reason: str
) -> None:
    path = by_hand(tmp_path / "v.nrrd", data, *fields, encoding=encoding)
    with pytest.raises(InputError, match=rf"v\.nrrd: .*{reason}"):
        load(path)
