"""Small files that ask for much: refused before anything is made, with nothing left open."""

from __future__ import annotations

import bz2
import gzip
import io
import os
import struct
import subprocess
import sys
import time
from pathlib import Path

import netCDF4
import nibabel
import numpy as np
import pytest
import tifffile
from support.processes import open_files
from support.refusal import refused

from texvol import InputError, load
from texvol.formats.readers import child_process
from texvol.formats.readers.samples import FileFault

DATA = bytes(120)
NRRD = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: %s\n"
MHA = b"ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementDataFile = %s\n"
OME = (
    '<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" '
    'DimensionOrder="XYZCT" Type="uint16" SizeX="8" SizeY="8" SizeZ="{}" SizeC="{}" SizeT="{}">{}'
    "</Pixels></Image></OME>"
)


def ome(z: int, c: int, t: int, data: str = "<TiffData/>") -> bytes:
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.zeros((2, 8, 8), "u2"), description=OME.format(z, c, t, data), metadata=None)
    return stream.getvalue()


def nifti(offset: float) -> bytes:
    header = nibabel.Nifti1Header()
    header.set_data_dtype("i2")
    header.set_data_shape((5, 4, 3))
    header["vox_offset"], header["magic"] = offset, b"n+1"
    return gzip.compress(header.binaryblock + bytes(4) + DATA)


def huge_pages() -> bytes:
    """Two pages of 60,000 by 60,000 pixels, packed into a hundred bytes."""
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.zeros((2, 64, 64), "u1"), compression="zlib", metadata=None)
    content = bytearray(stream.getvalue())
    with tifffile.TiffFile(io.BytesIO(content)) as tif:
        for page in tif.pages:
            for name in ("ImageWidth", "ImageLength", "RowsPerStrip"):
                tag = page.tags[name]
                size = {3: 2, 4: 4}[tag.dtype]
                content[tag.valueoffset : tag.valueoffset + size] = (60000).to_bytes(size, "little")
    return bytes(content)


def tiny_pages(count: int) -> bytes:
    """A chain of pages of one pixel, which is the same for all."""
    tags = [(256, 1), (257, 1), (258, 8), (259, 1), (262, 1), (273, 8), (277, 1), (278, 1), (279, 1)]
    fields = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    size = 2 + len(fields) + 4
    pages = (
        struct.pack("<H", len(tags)) + fields + struct.pack("<I", 16 + size * number if number < count else 0)
        for number in range(1, count + 1)
    )
    return b"II*\0" + struct.pack("<I", 16) + bytes(8) + b"".join(pages)


BOMBS = {
    "lines.nrrd": (NRRD % b"raw" + b"line skip: 1000000000000\n\n" + DATA, "but it holds 1"),
    "text.nrrd": (NRRD % b"ascii" + b"line skip: 1000000000000\n\n" + b"1 " * 60, "but it holds 1"),
    "packed.nrrd": (NRRD % b"gzip" + b"line skip: 1000000000000\n\n" + DATA, "but it holds 1"),
    "bytes.nrrd": (NRRD % b"gzip" + b"byte skip: 9999999999\n\n" + gzip.compress(DATA), "may skip"),
    "bytes2.nrrd": (NRRD % b"bzip2" + b"byte skip: 9999999999\n\n" + bz2.compress(DATA), "may skip"),
    "digits.nhdr": (NRRD % b"raw" + b"data file: f%099999d.raw 1 3 1\n", "such as %03d"),
    "digits2.nhdr": (NRRD % b"raw" + b"data file: f%0999999999d.raw 1 3 1\n", "such as %03d"),
    "words.nhdr": (NRRD % b"raw" + b"data file: f%s.raw 1 3 1\n", "such as %03d"),
    "many.nhdr": (NRRD % b"raw" + b"data file: f%d.raw 1 99999999 1\n", "must be 1 to 100000, got 99999999"),
    "none.nhdr": (NRRD % b"raw" + b"data file: f%d.raw 1 3 0\n", "must be 1 to 100000, got 0"),
    "digits.mhd": (MHA % b"f%099999d.raw 1 3 1", "such as %03d"),
    "many.mhd": (MHA % b"f%d.raw 1 99999999 1", "must be 1 to 100000, got 99999999"),
    "z.ome.tif": (ome(100000000, 1, 1), "100000001 planes, but the file has 2 pages"),
    "c.ome.tif": (ome(1, 100000000, 1), "100000001 planes"),
    "t.ome.tif": (ome(1, 10000, 10000), "100000001 planes"),
    "planes.ome.tif": (ome(2, 1, 1, '<TiffData IFD="0" PlaneCount="100000000"/>'), "100000002 planes"),
    "huge.tif": (huge_pages(), "more than 10000 times"),
    "tiny.tif": (tiny_pages(200_000), "more than 32768 pages"),
    "offset.nii.gz": (nifti(2e9), "may skip"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_header_asks_for_no_more_than_its_file_holds(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    content, reason = BOMBS[name]
    (tmp_path / name).write_bytes(content)
    start = time.perf_counter()
    assert reason in refused(tmp_path / name, capfd)
    assert time.perf_counter() - start < 4  # half a second, mostly imports; before, minutes or for ever


def test_a_netcdf_variable_that_was_never_written(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with netCDF4.Dataset(tmp_path / "v.nc", "w") as dataset:
        for name in "zyx":
            dataset.createDimension(name, 700)
        dataset.createVariable("v", "f4", ("z", "y", "x"), zlib=True)
    assert "more than 10000 times" in refused(tmp_path / "v.nc", capfd)


def test_many_small_streams_in_one_take_no_time(tmp_path: Path) -> None:
    """The rest of the file is not copied for each stream, a megabyte for every twenty bytes."""
    (tmp_path / "v.raw.gz").write_bytes(gzip.compress(b"") * 200_000 + gzip.compress(DATA))
    start = time.perf_counter()
    assert load(tmp_path / "v.raw.gz", shape=(5, 4, 3), dtype="i2").dimensions == (5, 4, 3)
    assert time.perf_counter() - start < 4  # under a second on one core at 3 GHz; 8 s before


@pytest.fixture(scope="module")
def small_netcdf(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("netcdf") / "v.nc"
    with netCDF4.Dataset(path, "w") as dataset:
        for name in "zyx":
            dataset.createDimension(name, 10)
        variable = dataset.createVariable("v", "f4", ("z", "y", "x"), zlib=True)
        variable[:] = np.random.default_rng(0).random((10, 10, 10))
        variable.units = "m"
    return path.read_bytes()


def test_netcdf_files_that_cannot_be_opened_leave_nothing_open(tmp_path: Path, small_netcdf: bytes) -> None:
    """A link in a group's table that leads nowhere: the library refuses the file, and keeps it open."""
    path, leaks = tmp_path / "v.nc", 0
    before = open_files()
    random = np.random.default_rng(3)
    for _ in range(30):
        damaged = bytearray(small_netcdf)
        for at in random.integers(8, len(damaged), 30):
            damaged[at] = random.integers(256)
        path.write_bytes(damaged)
        try:
            load(path)
        except InputError:
            leaks += 1
        assert open_files() == before
    assert leaks > 5


def test_a_process_that_dies_or_hangs_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    before = open_files()
    monkeypatch.setattr(child_process, "_PATIENCE", 60.0)
    child_process.check_survived(lambda: None)
    for attempt, reason, patience in (
        (os.abort, "signal SIGABRT", 60.0),
        (lambda: os._exit(3), "status 3", 60.0),
        (lambda: time.sleep(100), "not opened within 0.3 seconds", 0.3),
        (lambda: 1 // 0, "cannot be read: .*division", 60.0),
    ):
        monkeypatch.setattr(child_process, "_PATIENCE", patience)
        with pytest.raises(FileFault, match=reason):
            child_process.check_survived(attempt)
    assert open_files() == before


def test_files_are_tried_out_where_there_is_no_stderr(tmp_path: Path, small_netcdf: bytes) -> None:
    (tmp_path / "v.nc").write_bytes(small_netcdf)
    code = "import os; os.close(0); os.close(2); import texvol; print(texvol.load('v.nc').dimensions)"
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True, check=False
    )
    assert done.stdout == "(10, 10, 10)\n"
