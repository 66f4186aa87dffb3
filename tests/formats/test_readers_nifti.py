"""NIfTI: affines, types, scaling, pairs, axes beyond three; written by nibabel."""

from __future__ import annotations

from pathlib import Path

import nibabel
import numpy as np
import pytest
from support import marked

from texvol import InputError, load

AFFINE = np.eye(4)
AFFINE[:3, :3] = marked.DIRECTION * marked.SPACING
AFFINE[:3, 3] = marked.ORIGIN

# Affines are kept as float32: six digits of positions up to 50.
ATOL = 1e-5


def written(path: Path, dtype: str = "<i2", kind: type = nibabel.Nifti1Image, unit: str = "mm") -> Path:
    header = kind.header_class(endianness=dtype[0])
    header.set_data_dtype(np.dtype(dtype))
    header.set_xyzt_units(unit)
    nibabel.save(kind(marked.marked(dtype).T, AFFINE, header), path)
    return path


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"])
def test_every_type_and_byte_order(tmp_path: Path, dtype: str, order: str) -> None:
    marked.check(load(written(tmp_path / "v.nii", order + dtype)), dtype, atol=ATOL)


@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
@pytest.mark.parametrize("ending", [".nii", ".nii.gz"])
def test_both_versions_packed_and_not(tmp_path: Path, ending: str, kind: type) -> None:
    volume = load(written(tmp_path / f"v{ending}", kind=kind))
    marked.check(volume, atol=ATOL)
    assert (volume.space, volume.unit) == ("right-anterior-superior", "mm")
    assert np.linalg.det(volume.direction) < 0


@pytest.mark.parametrize("named", [".hdr", ".img"])
def test_a_pair_is_read_by_either_name(tmp_path: Path, named: str) -> None:
    written(tmp_path / "v.img", kind=nibabel.Nifti1Pair)
    marked.check(load(tmp_path / f"v{named}"), atol=ATOL)
    (tmp_path / f"v{'.img' if named == '.hdr' else '.hdr'}").unlink()
    with pytest.raises(InputError, match="half of a NIfTI pair"):
        load(tmp_path / f"v{named}")


@pytest.mark.parametrize(("unit", "shown"), [("micron", "µm"), ("meter", "m"), ("unknown", "mm")])
def test_units(tmp_path: Path, unit: str, shown: str) -> None:
    assert load(written(tmp_path / "v.nii", unit=unit)).unit == shown


@pytest.mark.parametrize(
    ("slope", "intercept", "dtype"),
    [(2, -10, "i4"), (0.5, 3, "f4"), (np.nan, 5, "i2"), (0, 5, "i2"), (1, np.nan, "i2")],
)
def test_slope_and_intercept(tmp_path: Path, slope: float, intercept: float, dtype: str) -> None:
    header = nibabel.Nifti1Header()
    header.set_data_dtype(np.int16)
    header.set_data_shape(marked.DIMENSIONS)
    header["scl_slope"], header["scl_inter"], header["magic"], header["vox_offset"] = slope, intercept, b"n+1", 352
    (tmp_path / "v.nii").write_bytes(header.binaryblock + bytes(4) + marked.marked("<i2").tobytes())
    volume = load(tmp_path / "v.nii")
    is_applied = np.isfinite(slope) and slope != 0
    wanted = marked.marked("f8") * slope + np.nan_to_num(intercept) if is_applied else marked.marked("f8")
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.values, wanted)


def test_qform_is_used_without_sform_and_pixdim_without_both(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(marked.marked().T, AFFINE)
    image.set_qform(AFFINE, 1)
    image.set_sform(None, 0)
    nibabel.save(image, tmp_path / "q.nii")
    marked.check(load(tmp_path / "q.nii"), atol=ATOL)
    image.set_qform(None, 0)
    nibabel.save(image, tmp_path / "p.nii")
    volume = load(tmp_path / "p.nii")
    marked.check(volume, position=np.multiply(marked.SPACING, marked.MARK), atol=ATOL)
    assert volume.space == ""


def test_time_steps_and_components(tmp_path: Path) -> None:
    one = marked.marked().T
    nibabel.save(nibabel.Nifti1Image(np.stack([one * 0, one], axis=3), AFFINE), tmp_path / "t.nii")
    marked.check(load(tmp_path / "t.nii", time=1), atol=ATOL)
    with pytest.raises(InputError, match=r"4 axes .*--time 0\.\.1"):
        load(tmp_path / "t.nii")
    vectors = np.stack([one * 0, one], axis=3)[:, :, :, np.newaxis]
    nibabel.save(nibabel.Nifti1Image(vectors, AFFINE), tmp_path / "c.nii")
    marked.check(load(tmp_path / "c.nii", channel=1), atol=ATOL)
    nibabel.save(nibabel.Nifti1Image(one[..., np.newaxis], AFFINE), tmp_path / "one.nii")
    marked.check(load(tmp_path / "one.nii"), atol=ATOL)


def test_colours_that_are_not_wanted_as_such_need_a_channel(tmp_path: Path) -> None:
    colours = np.zeros(marked.DIMENSIONS, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    colours["G"] = marked.marked("u1").T
    nibabel.save(nibabel.Nifti1Image(colours, AFFINE), tmp_path / "v.nii")
    marked.check(load(tmp_path / "v.nii", channel=1), "u1", atol=ATOL)
    with pytest.raises(InputError, match=r"--channel 0\.\.2"):
        load(tmp_path / "v.nii", color=False)


def patched(path: Path, at: int, data: bytes) -> Path:
    """Overwrite bytes of a file."""
    content = bytearray(path.read_bytes())
    content[at : at + len(data)] = data
    path.write_bytes(content)
    return path


FLOAT_NAN = np.float32(np.nan).tobytes()


@pytest.mark.parametrize(
    ("at", "data", "reason"),
    [
        (42, np.int16(6).tobytes(), "holds 120 bytes of samples, .* need 144"),
        (42, np.int16(4).tobytes(), "holds 120 bytes of samples, .* need 96"),
        (42, np.int16(-5).tobytes(), "positive"),
        (42, np.int16([32767, 32767, 32767]).tobytes(), "this machine has"),
        (70, np.int16(32).tobytes(), "complex"),
        (70, np.int16(1).tobytes(), "NIfTI"),
        (108, np.float32(10).tobytes(), "NIfTI"),
        (108, FLOAT_NAN, "NIfTI"),
        (280, FLOAT_NAN, "finite"),
        (280, bytes(48), "singular"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(tmp_path: Path, at: int, data: bytes, reason: str) -> None:
    path = patched(written(tmp_path / "v.nii"), at, data)
    with pytest.raises(InputError, match=rf"v\.nii: .*{reason}"):
        load(path)


@pytest.mark.parametrize("spacing", [-3, 0, np.nan, np.inf])
@pytest.mark.parametrize("qform_code", [0, 1])
def test_a_wrong_pixdim_that_defines_the_grid_is_refused(tmp_path: Path, qform_code: int, spacing: float) -> None:
    path = patched(written(tmp_path / "v.nii"), 252, np.int16([qform_code, 0]).tobytes())
    patched(path, 84, np.float32(spacing).tobytes())
    with pytest.raises(InputError, match=r"spacing|pixdims|finite"):
        load(path)
