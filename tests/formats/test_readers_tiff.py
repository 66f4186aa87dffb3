"""TIFF: stacks, folders of slices, calibration and channels of ImageJ and OME; written by tifffile."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import tifffile
from support import marked

from texvol import InputError, load

OME = {"PhysicalSizeX": 2.0, "PhysicalSizeY": 3.0, "PhysicalSizeZ": 4.0, "PhysicalSizeXUnit": "nm"}
OME |= {"PhysicalSizeYUnit": "nm", "PhysicalSizeZUnit": "nm"}
GREY = {"photometric": "minisblack"}


def written(path: Path, values: np.ndarray | None = None, **options: object) -> Path:
    tifffile.imwrite(path, marked.marked() if values is None else values, **(GREY | options))
    return path


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"])
def test_every_type_and_byte_order(tmp_path: Path, dtype: str, order: str) -> None:
    path = written(tmp_path / "v.tif", marked.marked(dtype), byteorder=order)
    marked.check(load(path), dtype, position=marked.MARK)


@pytest.mark.parametrize(
    "options",
    [
        {"compression": "zlib"},
        {"compression": "lzw"},
        {"compression": "zstd"},
        {"bigtiff": True},
        {"tile": (16, 16)},
        {"rowsperstrip": 1},
        {"contiguous": False, "metadata": None},
    ],
)
def test_every_layout(tmp_path: Path, options: dict[str, object]) -> None:
    marked.check(load(written(tmp_path / "v.tiff", **options)), position=marked.MARK)


def test_pages_written_one_by_one_are_a_stack(tmp_path: Path) -> None:
    with tifffile.TiffWriter(tmp_path / "v.tif") as writer:
        for piece in marked.marked():
            writer.write(piece, metadata=None, contiguous=False)
    marked.check(load(tmp_path / "v.tif"), position=marked.MARK)


@pytest.mark.parametrize(("unit", "shown"), [("micron", "µm"), ("um", "µm"), ("mm", "mm"), ("pixel", ""), ("", "")])
def test_imagej_calibration(tmp_path: Path, unit: str, shown: str) -> None:
    path = tmp_path / "v.tif"
    metadata = {"axes": "ZYX", "spacing": 4.0, "unit": unit}
    written(path, marked.marked("u2"), imagej=True, resolution=(1 / 2, 1 / 4), metadata=metadata)
    volume = load(path)
    marked.check(volume, "u2", position=np.multiply((2, 4, 4), marked.MARK))
    assert volume.unit == shown


@pytest.mark.parametrize("axes", ["ZCYX", "TZYX", "TZCYX"])
def test_imagej_channels_and_time_steps(tmp_path: Path, axes: str) -> None:
    option = {"ZCYX": {"channel": 1}, "TZYX": {"time": 1}, "TZCYX": {"time": 1, "channel": 1}}[axes]
    check_selection(tmp_path / "v.tif", axes, option, imagej=True)


@pytest.mark.parametrize("axes", ["CZYX", "ZCYX", "TZYX", "TCZYX", "CTZYX"])
def test_ome_channels_and_time_steps(tmp_path: Path, axes: str) -> None:
    option = ({"channel": 1} if "C" in axes else {}) | ({"time": 1} if "T" in axes else {})
    check_selection(tmp_path / "v.ome.tif", axes, option, ome=True)


def check_selection(path: Path, axes: str, option: dict[str, int], **kind: bool) -> None:
    """Write a file that holds the marked volume at the last place of each further axis, and find it there."""
    values = np.zeros([{"Z": 3, "Y": 4, "X": 5}.get(axis, 2) for axis in axes], "u2")
    values[tuple(slice(None) if axis in "ZYX" else 1 for axis in axes)] = marked.marked("u2")
    written(path, values, metadata={"axes": axes}, **kind)
    marked.check(load(path, **option), "u2", position=marked.MARK)
    if "T" in axes:
        with pytest.raises(InputError, match=rf"has {len(axes)} axes .*choose one with --time 0\.\.1"):
            load(path)
    if "C" in axes:
        first = load(path, **({"time": 1} if "T" in axes else {}))
        assert not first.values.any() and first.channel is not None and first.channel.number == 0
        assert [each.number for each in first.channels] == [0, 1]
        assert any("channel 0 of 2" in each and "--channel N chooses" in each for each in first.notes)


def test_ome_calibration(tmp_path: Path) -> None:
    path = written(tmp_path / "v.ome.tif", marked.marked("u2"), ome=True, metadata={"axes": "ZYX"} | OME)
    volume = load(path)
    marked.check(volume, "u2", position=np.multiply((2, 3, 4), marked.MARK))
    assert volume.unit == "nm"


def test_ome_units_that_differ_become_one(tmp_path: Path) -> None:
    metadata = {"axes": "ZYX"} | OME | {"PhysicalSizeZUnit": "mm"}
    volume = load(written(tmp_path / "v.ome.tif", marked.marked("u2"), ome=True, metadata=metadata))
    assert (volume.unit, volume.spacing.tolist()) == ("nm", pytest.approx([2, 3, 4e6]))
    metadata["PhysicalSizeZUnit"] = "reference frame"
    with pytest.raises(InputError, match="must have units of length for its spacing, got nm, nm, reference frame"):
        load(written(tmp_path / "w.ome.tif", marked.marked("u2"), ome=True, metadata=metadata))


def test_one_of_several_files_of_a_set_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "v.ome.tif", marked.marked("u2"), ome=True, metadata={"axes": "ZYX"})
    content = path.read_bytes()
    found = re.search(rb"<TiffData[^>]*>.*?</TiffData>|<TiffData[^>]*/>", content, re.S)
    assert found
    names = b'<UUID FileName="../../a.tif">x</UUID><UUID FileName="b.tif">x</UUID>'
    text = tifffile.TiffFile(path).ome_metadata.replace("<TiffData", f"{names.decode()}<TiffData", 1)
    tifffile.imwrite(path, marked.marked("u2"), description=text, metadata=None, **GREY)
    with pytest.raises(InputError, match=r"one of 2 files|does not fit its pages"):
        load(path)


def test_colours_that_are_not_wanted_as_such_need_a_channel(tmp_path: Path) -> None:
    colours = np.stack([marked.marked("u1") * 0, marked.marked("u1"), marked.marked("u1") * 0], axis=3)
    path = written(tmp_path / "v.tif", colours, photometric="rgb")
    marked.check(load(path, channel=1), "u1", position=marked.MARK)
    with pytest.raises(InputError, match=r"--channel 0\.\.2"):
        load(path, color=False)


def slices(folder: Path) -> Path:
    """Twelve slices in a folder, whose names sort wrongly as text; the marked one is slice 2."""
    folder.mkdir()
    for number in range(12):
        written(folder / f"slice{number}.tif", marked.marked()[2] if number == 2 else marked.marked()[0])
    return folder


def test_a_folder_is_read_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    folder = slices(tmp_path / "stack")
    (folder / "notes.txt").write_text("not a slice")
    volume = load(folder, spacing=marked.SPACING)
    assert volume.dimensions == (5, 4, 12)
    np.testing.assert_allclose(marked.found_mark(volume), np.multiply(marked.SPACING, marked.MARK))


def spoil_sizes(folder: Path) -> None:
    written(folder / "slice5.tif", np.zeros((4, 6), "i2"))


def spoil_types(folder: Path) -> None:
    written(folder / "slice5.tif", np.zeros((4, 5), "f4"))


def spoil_pages(folder: Path) -> None:
    written(folder / "slice5.tif", np.zeros((2, 4, 5), "i2"))


def spoil_colour(folder: Path) -> None:
    written(folder / "slice5.tif", np.zeros((4, 5, 3), "i2"), photometric="rgb")


def spoil_content(folder: Path) -> None:
    (folder / "slice5.tif").write_bytes(b"II*\0garbage that is no TIFF")


def spoil_length(folder: Path) -> None:
    (folder / "slice5.tif").write_bytes((folder / "slice5.tif").read_bytes()[:-10])


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (spoil_sizes, r"slice5\.tif: .*mixed sizes.* 5 x 4 and 6 x 5|mixed sizes.* 5 x 4 and 6 x 4"),
        (spoil_types, r"slice5\.tif: .*mixed types"),
        (spoil_pages, r"slice5\.tif: .*one page"),
        (spoil_colour, r"slice5\.tif: .*one (page|channel)"),
        (spoil_content, r"slice5\.tif: "),
        (spoil_length, r"slice5\.tif: .*truncated"),
    ],
)
def test_a_folder_that_is_no_volume_is_refused(tmp_path: Path, spoil: type, reason: str) -> None:
    folder = slices(tmp_path / "stack")
    spoil(folder)
    with pytest.raises(InputError, match=rf"stack: .*({reason})"):
        load(folder)


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"contiguous": False, "metadata": None}])
def test_a_truncated_file_is_no_shorter_volume(tmp_path: Path, options: dict[str, object]) -> None:
    """A reader that stops where the chain of pages breaks would return the slices before the break."""
    values = np.random.default_rng(1).integers(0, 1000, (8, 32, 32)).astype("u2")
    path = written(tmp_path / "v.tif", values, **options)
    content = path.read_bytes()
    for length in range(8, len(content) - 1, 97):
        path.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"v\.tif: "):
            load(path)


def test_pages_that_go_round_in_a_circle_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "v.tif", contiguous=False, metadata=None)
    with tifffile.TiffFile(path) as tif:
        offsets = [page.offset for page in tif.pages]
        fields = len(tif.pages[2].tags)
    content = bytearray(path.read_bytes())
    at = offsets[2] + 2 + 12 * fields
    content[at : at + 4] = offsets[0].to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(InputError, match="followed by an earlier page"):
        load(path)


def test_a_flat_picture_and_a_flat_set_of_channels_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"must have 3 axes, got 2 \(5 x 4\)"):
        load(written(tmp_path / "v.tif", marked.marked()[0]))
    values = marked.marked("u2")[:2]
    with pytest.raises(InputError, match="must have 3 axes, got 2"):
        load(written(tmp_path / "v.tif", values, imagej=True, metadata={"axes": "CYX"}))
    with pytest.raises(InputError, match="must have 3 axes, got 2"):
        load(tmp_path / "v.tif", channel=1)


def test_a_folder_of_one_stack_is_that_stack(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    shutil.move(written(tmp_path / "v.tif"), tmp_path / "folder")
    marked.check(load(tmp_path / "folder"), position=marked.MARK)
