"""What a header may ask for: memory that there is, unpacking that it needs, files of its own folder."""

from __future__ import annotations

import bz2
import gzip
import io
import tracemalloc
import zlib
from pathlib import Path

import nibabel
import numpy as np
import pytest
from support import marked
from support.refusal import refused

HUGE = {
    "v.npy": b"\x93NUMPY\x01\x00\x76\x00"
    + b"{'descr': '<f8', 'fortran_order': False, 'shape': (999999, 999999, 999999)}".ljust(117)
    + b"\n",
    "v.nrrd": b"NRRD0004\ntype: double\ndimension: 3\nsizes: 99999999999 99999999999 99999999999\nendian: little\n"
    b"encoding: raw\n\n",
    "v.mha": b"ObjectType = Image\nNDims = 3\nDimSize = 9999999 9999999 9999999\nElementType = MET_DOUBLE\n"
    b"ElementDataFile = LOCAL\n",
    "v.vti": b'<VTKFile type="ImageData"><ImageData WholeExtent="0 999999 0 999999 0 999999">'
    b'<Piece Extent="0 999999 0 999999 0 999999"><PointData><DataArray type="Float64" format="ascii">1</DataArray>'
    b"</PointData></Piece></ImageData></VTKFile>",
}


@pytest.mark.parametrize("name", HUGE)
def test_a_header_that_asks_for_more_memory_than_there_is(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(HUGE[name] + bytes(100 if name != "v.vti" else 0))
    assert "this machine has" in refused(tmp_path / name, capfd)


def bomb_nrrd(data: bytes) -> bytes:
    return b"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: gzip\n\n" + gzip.compress(
        data
    )


def bomb_nifti(data: bytes) -> bytes:
    stream = io.BytesIO()
    header = nibabel.Nifti1Header()
    header.set_data_dtype(np.int16)
    header.set_data_shape(marked.DIMENSIONS)
    header["vox_offset"], header["magic"] = 352, b"n+1"
    stream.write(header.binaryblock + bytes(4) + data)
    return gzip.compress(stream.getvalue(), mtime=0)


def bomb_metaimage(data: bytes) -> bytes:
    return (
        b"ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nCompressedData = True\n"
        b"ElementDataFile = LOCAL\n" + zlib.compress(data)
    )


BOMBS = {
    "v.nrrd": bomb_nrrd,
    "v.nii.gz": bomb_nifti,
    "v.mha": bomb_metaimage,
    "v.raw.gz": gzip.compress,
    "v.raw.bz2": bz2.compress,
}


@pytest.mark.parametrize("name", BOMBS)
def test_of_a_bomb_no_more_is_unpacked_than_wanted(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(BOMBS[name](bytes(50_000_000)))
    options = {"shape": marked.DIMENSIONS, "dtype": "<i2"} if "raw" in name else {}
    tracemalloc.start()
    assert "more than 120 bytes" in refused(tmp_path / name, capfd, **options)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # A block unpacked, one being sliced, one of the file: 3 MiB, and the libraries' own modules.
    assert peak < 20e6


OUTSIDE = [
    "../secret.raw",
    "/etc/hostname",
    "{inner}/inside.raw",
    "link.raw",
    "folder/../../secret.raw",
    "absent.raw",
    "folder",
]


@pytest.mark.parametrize("kind", ["nrrd", "nrrd list", "metaimage", "metaimage list"])
@pytest.mark.parametrize("target", OUTSIDE)
def test_a_detached_header_reaches_only_its_own_folder(
    tmp_path: Path, target: str, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "secret.raw").write_bytes(marked.marked().tobytes())
    inner = tmp_path / "inner"
    (inner / "folder").mkdir(parents=True)
    (inner / "link.raw").symlink_to(tmp_path / "secret.raw")
    (inner / "inside.raw").write_bytes(marked.marked().tobytes())
    target = target.format(inner=inner)
    path = inner / ("v.nhdr" if "nrrd" in kind else "v.mhd")
    named = f"LIST\n{target}\n" if "list" in kind else f"{target}\n"
    if "nrrd" in kind:
        text = f"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\ndata file: {named}"
    else:
        text = f"ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementDataFile = {named}"
    path.write_text(text)
    message = refused(path, capfd)
    assert any(reason in message for reason in ("outside", "absolute", "does not exist", "not a regular file"))
