"""What all readers share: NPY and raw files, detection, axes beyond three, rescaling, what is imported."""

from __future__ import annotations

import bz2
import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import marked

from texvol import InputError, load
from texvol.formats.readers.samples import FileFault, grid_from_columns, in_bytes, rescaled

REAL_TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"]
BYTE_ORDERS = ["<", ">"]


@pytest.mark.parametrize("order", BYTE_ORDERS)
@pytest.mark.parametrize("dtype", REAL_TYPES)
def test_an_npy_of_any_real_type_and_byte_order_is_read(tmp_path: Path, dtype: str, order: str) -> None:
    np.save(tmp_path / "v.npy", marked.marked(order + dtype))
    volume = load(tmp_path / "v.npy")
    marked.check(volume, dtype, position=marked.MARK)
    assert volume.name == str(tmp_path / "v.npy")


def test_an_npy_in_fortran_order_is_read(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.asfortranarray(marked.marked()))
    marked.check(load(tmp_path / "v.npy"), position=marked.MARK)


def test_given_spacing_replaces_the_files(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked())
    volume = load(tmp_path / "v.npy", spacing=(2, 3, 4))
    marked.check(volume, position=np.multiply((2, 3, 4), marked.MARK))


@pytest.mark.parametrize("order", BYTE_ORDERS)
@pytest.mark.parametrize("dtype", REAL_TYPES)
def test_raw_samples_of_any_real_type_and_byte_order_are_read(tmp_path: Path, dtype: str, order: str) -> None:
    (tmp_path / "v.raw").write_bytes(marked.marked(order + dtype).tobytes())
    volume = load(tmp_path / "v.raw", shape=marked.DIMENSIONS, dtype=order + dtype)
    marked.check(volume, dtype, position=marked.MARK)


@pytest.mark.parametrize(("ending", "pack"), [(".raw.gz", gzip.compress), (".raw.bz2", bz2.compress), (".bin", bytes)])
def test_raw_samples_are_unpacked(tmp_path: Path, ending: str, pack: type[bytes]) -> None:
    path = tmp_path / f"v{ending}"
    path.write_bytes(pack(marked.marked().tobytes()))
    volume = load(path, shape=marked.DIMENSIONS, dtype="int16", spacing=marked.SPACING)
    marked.check(volume, position=np.multiply(marked.SPACING, marked.MARK))


def test_streams_that_follow_one_another_are_one(tmp_path: Path) -> None:
    data = marked.marked().tobytes()
    (tmp_path / "v.raw.gz").write_bytes(gzip.compress(data[:33]) + gzip.compress(data[33:]) + bytes(512))
    marked.check(load(tmp_path / "v.raw.gz", shape=marked.DIMENSIONS, dtype="int16"), position=marked.MARK)


@pytest.mark.parametrize("name", ["unknown.xyz", "noextension"])
def test_a_file_without_a_known_name_is_read_by_its_content(tmp_path: Path, name: str) -> None:
    np.save(tmp_path / "v.npy", marked.marked())
    (tmp_path / "v.npy").rename(tmp_path / name)
    marked.check(load(tmp_path / name), position=marked.MARK)


@pytest.mark.parametrize("option", ["channel", "time"])
@pytest.mark.parametrize("dtype", ["<i2", ">f4"])
def test_either_option_picks_along_an_unnamed_axis(tmp_path: Path, option: str, dtype: str) -> None:
    np.save(tmp_path / "v.npy", np.stack([np.zeros((3, 4, 5), dtype), marked.marked(dtype)]))
    marked.check(load(tmp_path / "v.npy", **{option: 1}), dtype[1:], position=marked.MARK)
    with pytest.raises(InputError, match=r"has 4 axes .*--channel 0\.\.1"):
        load(tmp_path / "v.npy")
    with pytest.raises(InputError, match=rf"--{option} must be in 0\.\.1, got 2"):
        load(tmp_path / "v.npy", **{option: 2})
    with pytest.raises(InputError, match=rf"--{option} must be in 0\.\.1, got -1"):
        load(tmp_path / "v.npy", **{option: -1})


def test_a_fortran_ordered_axis_is_picked(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.asfortranarray(np.stack([marked.marked() * 0, marked.marked()])))
    marked.check(load(tmp_path / "v.npy", channel=1), position=marked.MARK)


def test_an_axis_of_one_needs_no_choice(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked()[np.newaxis])
    marked.check(load(tmp_path / "v.npy"), position=marked.MARK)


def test_an_option_without_its_axis_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked())
    marked.check(load(tmp_path / "v.npy", channel=0), position=marked.MARK)
    with pytest.raises(InputError, match="no channel axis"):
        load(tmp_path / "v.npy", channel=1)
    with pytest.raises(InputError, match="--series"):
        load(tmp_path / "v.npy", series="3")
    with pytest.raises(InputError, match="--shape"):
        load(tmp_path / "v.npy", shape=(5, 4, 3))


@pytest.mark.parametrize(
    ("stored", "slope", "intercept", "expected"),
    [
        ("u1", 2, 10, "u2"),  # 10 .. 520
        ("u2", 1, -1024, "i4"),  # -1024 .. 64511
        ("u1", 1, -100, "i2"),
        ("i2", -1, 0, "i4"),  # 32768 does not fit into int16
        ("u1", -1, 0, "i2"),
        ("i4", 2, 0, "i8"),
        ("u1", 0.5, 0, "f4"),
        ("i2", 1, 0.5, "f4"),
        ("i4", 0.5, 0, "f8"),
        ("u8", 2, 0, "f8"),
        ("f4", 2, 1, "f4"),
        ("f2", 2, 1, "f4"),
        ("f8", 2, 1, "f8"),
    ],
)
def test_rescaling_takes_the_smallest_type_that_is_exact(
    stored: str, slope: float, intercept: float, expected: str
) -> None:
    dtype = np.dtype(stored)
    ends = [0, 1, 100] if dtype.kind == "f" else [np.iinfo(dtype).min, np.iinfo(dtype).max, 5]
    values = np.array(ends, dtype).reshape(3, 1, 1)
    result = rescaled(values, slope, intercept)
    assert result.dtype == np.dtype(expected)
    wanted = [float(value) * slope + intercept for value in values.ravel().tolist()]
    # A float32 holds 24 bits: half a unit of the last place is 2**-24 of the value.
    np.testing.assert_allclose(result.ravel().astype(float), wanted, rtol=2**-24 if expected == "f4" else 2**-53)


def test_rescaling_uses_only_the_stored_bits() -> None:
    assert rescaled(np.zeros((1, 1, 1), "u2"), 1, -1024, bits=12).dtype == np.int16  # -1024 .. 3071


@pytest.mark.parametrize("slope", [0.0, np.nan, np.inf])
def test_rescaling_by_nothing_is_refused(slope: float) -> None:
    with pytest.raises(FileFault, match="slope"):
        rescaled(np.zeros((1, 1, 1), "u1"), slope, 0)


def test_a_step_of_zero_is_named_and_a_tiny_one_kept() -> None:
    with pytest.raises(FileFault, match="along axis y is 0, 0, 0"):
        grid_from_columns(np.diag([1.0, 0.0, 1.0]))
    spacing, direction = grid_from_columns(np.diag([1e-200, -1e200, 3.0]))  # whose squares are 0 and infinite
    np.testing.assert_allclose(spacing, [1e-200, 1e200, 3.0])
    np.testing.assert_allclose(direction, np.diag([1.0, -1.0, 1.0]))


def test_bytes_are_written_as_people_do() -> None:
    assert [in_bytes(count) for count in (54000, 2**20, 3 * 2**30, 2**62)] == [
        "54000 bytes",
        "1 MiB",
        "3 GiB",
        "4.1e+03 PiB",
    ]


def test_reading_an_npy_imports_no_other_format(tmp_path: Path) -> None:
    """The cold start is counted in tenths of a second; nibabel alone takes 0.17."""
    np.save(tmp_path / "v.npy", marked.marked())
    heavy = [
        "nrrd",
        "nibabel",
        "pydicom",
        "tifffile",
        "mrcfile",
        "SimpleITK",
        "vtkmodules",
        "xml",
        "logging",
        "tempfile",
        "scipy",
        "numba",
        "bz2",
        "gzip",
    ]
    code = (
        "import sys, numpy; before = set(sys.modules); from texvol.formats.readers import load; "
        f"load({str(tmp_path / 'v.npy')!r}); print(*sorted((set(sys.modules) - before) & set({heavy!r})))"
    )
    repository = Path(__file__).resolve().parents[2]
    result = subprocess.run([sys.executable, "-c", code], cwd=repository, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == ""
