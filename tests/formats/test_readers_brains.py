"""Formats of brain images, Analyze, AFNI, MGH, MINC 1 and 2, GIPL: where samples lie is compared with libraries."""

from __future__ import annotations

import gzip
import struct
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import nibabel
import numpy as np
import pytest
import SimpleITK
from scipy.io import savemat
from support import marked

from texvol import InputError, Volume, load

AXIS_NAMES = ("zspace", "yspace", "xspace")


def check_against_nibabel(volume: Volume, path: Path, **index: int) -> None:
    """Fail unless the volume has nibabel's values at nibabel's positions."""
    image: Any = nibabel.load(path)
    values = np.asarray(image.dataobj)
    at = np.unravel_index(np.argmax(values), values.shape)
    np.testing.assert_allclose(marked.found_mark(volume), (image.affine @ [*at[:3], 1])[:3], atol=1e-4)
    assert (volume.space, volume.unit) == ("right-anterior-superior", "mm")


def written_analyze(folder: Path, kind: type = nibabel.Spm2AnalyzeImage, **fields: Any) -> Path:
    image = kind(marked.marked().T, np.diag([-2.0, 3, 4, 1]))
    image.header.set_data_dtype(np.int16)
    for name, value in fields.items():
        image.header[name] = value
    nibabel.save(image, folder / "v.img")
    return folder / "v.img"


def test_analyze_has_no_directions_and_says_so(tmp_path: Path) -> None:
    path = written_analyze(tmp_path, nibabel.AnalyzeImage)
    volume = load(path)
    np.testing.assert_array_equal(volume.values, marked.marked())
    check_against_nibabel(volume, path)
    assert np.diag(volume.direction).tolist() == [-1, 1, 1] and volume.spacing.tolist() == [2, 3, 4]
    assert any("no directions" in note for note in volume.notes)
    np.testing.assert_array_equal(load(tmp_path / "v.hdr").values, volume.values)


@pytest.mark.parametrize("kind", [nibabel.Spm99AnalyzeImage, nibabel.Spm2AnalyzeImage])
def test_directions_that_spm_writes_beside(tmp_path: Path, kind: type) -> None:
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = marked.DIRECTION * marked.SPACING, marked.ORIGIN
    nibabel.save(kind(marked.marked().T, affine), tmp_path / "v.img")
    volume = load(tmp_path / "v.hdr")
    check_against_nibabel(volume, tmp_path / "v.img")
    np.testing.assert_allclose(marked.found_mark(volume), marked.position_of_mark(), atol=1e-6)
    assert volume.notes == ("it lies where v.mat says",)
    # SPM 99 and before wrote M alone, with x the other way.
    savemat(tmp_path / "v.mat", {"M": np.diag([-1.0, 1, 1, 1]) @ affine @ np.array(_FROM_ZERO)}, format="4")
    check_against_nibabel(load(tmp_path / "v.img"), tmp_path / "v.img")


_FROM_ZERO = [[1.0, 0, 0, -1], [0, 1, 0, -1], [0, 0, 1, -1], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("variables", "reason"),
    [
        ({"mat": np.eye(3)}, "a finite matrix of 4 x 4"),
        ({"mat": np.full((4, 4), np.nan)}, "a finite matrix of 4 x 4"),
        ({"other": np.eye(4)}, "must hold a matrix mat or M"),
        ({"mat": np.zeros((4, 9000))}, "at most 262144 bytes"),
        (None, "v.img: cannot be read: "),
    ],
)
def test_a_mat_beside_that_makes_no_sense(tmp_path: Path, variables: Any, reason: str) -> None:
    path = written_analyze(tmp_path)
    if variables is None:
        (tmp_path / "v.mat").write_bytes(b"no matrix")
    else:
        savemat(tmp_path / "v.mat", variables)
    with pytest.raises(InputError, match=rf"v\.img: .*{reason}|{reason}"):
        load(path)


def test_spms_origin_and_slope(tmp_path: Path) -> None:
    path = written_analyze(tmp_path)
    (tmp_path / "v.mat").unlink()
    block = bytearray((tmp_path / "v.hdr").read_bytes())
    struct.pack_into("<3h", block, 253, 4, 2, 3)  # the origin is this sample, from 1
    struct.pack_into("<f", block, 112, 0.5)
    (tmp_path / "v.hdr").write_bytes(block)
    volume = load(path)
    np.testing.assert_allclose(volume.origin + volume.world_from_index @ [3, 1, 2], 0, atol=1e-5)
    np.testing.assert_array_equal(volume.values, marked.marked() * np.float32(0.5))


@pytest.mark.parametrize(
    ("at", "data", "reason"),
    [
        (42, struct.pack("<h", 600), "holds 120 bytes of samples"),
        (76 + 4, struct.pack("<f", -1), "spacing must be positive"),
        (76 + 4, struct.pack("<f", float("nan")), "spacing must be positive"),
        (70, struct.pack("<h", 32), "complex"),
        (108, struct.pack("<f", float("nan")), "begin at byte 0"),
    ],
)
def test_an_analyze_header_that_makes_no_sense(tmp_path: Path, at: int, data: bytes, reason: str) -> None:
    path = written_analyze(tmp_path)
    (tmp_path / "v.mat").unlink()
    block = bytearray((tmp_path / "v.hdr").read_bytes())
    block[at : at + len(data)] = data
    (tmp_path / "v.hdr").write_bytes(block)
    with pytest.raises(InputError, match=rf"v\.img: .*{reason}"):
        load(path)


@pytest.mark.parametrize("name", ["v.mgh", "v.mgz"])
@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "f4"])
def test_mgh(tmp_path: Path, name: str, dtype: str) -> None:
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = marked.DIRECTION * marked.SPACING, marked.ORIGIN
    steps = np.stack([marked.marked(dtype).T, 2 * marked.marked(dtype).T], axis=3)
    nibabel.save(nibabel.MGHImage(steps, affine), tmp_path / name)
    # FreeSurfer writes more after the samples.
    with (gzip.open if name == "v.mgz" else open)(tmp_path / name, "ab") as file:
        file.write(b"tags")
    for step in (0, 1):
        volume = load(tmp_path / name, time=step)
        np.testing.assert_array_equal(volume.values, (1 + step) * marked.marked(dtype))
        check_against_nibabel(volume, tmp_path / name)


def test_an_mgh_that_says_nothing_of_directions(tmp_path: Path) -> None:
    nibabel.save(nibabel.MGHImage(marked.marked("u1").T, np.diag([-2.0, 3, 4, 1])), tmp_path / "v.mgh")
    content = bytearray((tmp_path / "v.mgh").read_bytes())
    struct.pack_into(">h", content, 28, 0)
    (tmp_path / "v.mgh").write_bytes(content)
    volume = load(tmp_path / "v.mgh")  # FreeSurfer's coronal slices: to the left, down, and to the front
    np.testing.assert_array_equal(volume.direction, [[-1, 0, 0], [0, 0, 1], [0, -1, 0]])
    np.testing.assert_array_equal(volume.origin, [2.5, -1.5, 2])


@pytest.mark.parametrize(
    ("at", "number", "reason"),
    [(0, 2, "version must be 1"), (20, 7, "type of samples"), (4, 6, "holds"), (8, -1, "must be positive")],
)
def test_an_mgh_header_that_makes_no_sense(tmp_path: Path, at: int, number: int, reason: str) -> None:
    nibabel.save(nibabel.MGHImage(marked.marked("u1").T, np.eye(4)), tmp_path / "v.mgh")
    content = bytearray((tmp_path / "v.mgh").read_bytes()[:344])
    struct.pack_into(">i", content, at, number)
    (tmp_path / "v.mgh").write_bytes(content)
    with pytest.raises(InputError, match=rf"v\.mgh: .*{reason}"):
        load(tmp_path / "v.mgh")


def afni(**more: str) -> str:
    """A header of 5 x 4 x 3 samples, of which x runs from left to right, y from front to back, z from top to bottom."""
    numbers = {
        "DATASET_RANK": "3 1 0 0 0 0 0 0",
        "DATASET_DIMENSIONS": "5 4 3 0 0",
        "TYPESTRING": "",
        "SCENE_DATA": "0 11 1 -999 -999 -999 -999 -999",
        "ORIENT_SPECIFIC": "1 2 5",
        "BRICK_TYPES": "1",
        **more,
    }
    floats = {"ORIGIN": "10 -20 30.5", "DELTA": "-2 3 -4", "BRICK_FLOAT_FACS": more.pop("BRICK_FLOAT_FACS", "0")}
    floats["IJK_TO_DICOM_REAL"] = more.pop("IJK_TO_DICOM_REAL", "-2 0 0 10 0 3 0 -20 0 0 -4 30.5")
    text = ""
    for name, value in numbers.items():
        if name in ("TYPESTRING", "BRICK_FLOAT_FACS", "IJK_TO_DICOM_REAL"):
            continue
        text += f"\ntype  = integer-attribute\nname  = {name}\ncount = {len(value.split())}\n {value}\n"
    for name, value in floats.items():
        text += f"\ntype  = float-attribute\nname  = {name}\ncount = {len(value.split())}\n {value}\n"
    for name, value in (("TYPESTRING", "3DIM_HEAD_ANAT"), ("BYTEORDER_STRING", "LSB_FIRST"), ("BRICK_LABS", "one~two")):
        text += f"\ntype  = string-attribute\nname  = {name}\ncount = {len(value) + 1}\n'{value}~\n"
    return text


def written_afni(folder: Path, text: str, values: np.ndarray, packed: bool = False) -> Path:
    (folder / "v+orig.HEAD").write_text(text)
    name, content = ("v+orig.BRIK.gz", gzip.compress(values.tobytes())) if packed else ("v+orig.BRIK", values.tobytes())
    (folder / name).write_bytes(content)
    return folder / "v+orig.HEAD"


@pytest.mark.parametrize("packed", [False, True])
def test_afni(tmp_path: Path, packed: bool) -> None:
    path = written_afni(tmp_path, afni(), marked.marked("<i2"), packed)
    volume = load(path)
    np.testing.assert_array_equal(volume.values, marked.marked())
    check_against_nibabel(volume, path)
    assert "sub-brick 0: one" in volume.notes
    np.testing.assert_array_equal(load(tmp_path / f"v+orig.BRIK{'.gz' if packed else ''}").values, volume.values)


def test_afni_of_an_oblique_scan_and_of_old_programs(tmp_path: Path) -> None:
    columns = marked.DIRECTION * marked.SPACING
    rows = " ".join(f"{number:.9g}" for number in np.column_stack([columns, marked.ORIGIN]).ravel())
    path = written_afni(tmp_path, afni(IJK_TO_DICOM_REAL=rows), marked.marked("<i2"))
    volume = load(path)
    check_against_nibabel(volume, path)
    # AFNI's own coordinates are those of DICOM.
    np.testing.assert_allclose(marked.found_mark(volume), marked.position_of_mark() * [-1, -1, 1], atol=1e-5)
    plain = load(written_afni(tmp_path, afni(), marked.marked("<i2")))
    old = load(written_afni(tmp_path, afni().replace("IJK_TO_DICOM_REAL", "OTHER"), marked.marked("<i2")))
    np.testing.assert_allclose(old.world_from_index, plain.world_from_index)
    np.testing.assert_allclose(old.origin, plain.origin)


def test_sub_bricks_of_afni_are_channels_or_times(tmp_path: Path) -> None:
    values = np.stack([marked.marked("<i2") * 0, marked.marked("<i2")])
    several = {"DATASET_RANK": "3 2 0 0 0 0 0 0", "BRICK_TYPES": "1 1"}
    text = afni(**several, BRICK_FLOAT_FACS="0 0.5")
    path = written_afni(tmp_path, text, values)
    np.testing.assert_array_equal(load(path, channel=1).values, marked.marked() * np.float32(0.5))
    # They are statistics and the like, no components of a vector: the first one is read.
    first = load(path)
    assert first.values.max() == 0 and "sub-brick 0 one of 2: 0 one, 1 two; --channel N chooses" in first.notes
    timed = text + "\ntype = integer-attribute\nname = TAXIS_NUMS\ncount = 3\n 2 0 77002\n"
    timed += "\ntype = float-attribute\nname = TAXIS_FLOATS\ncount = 5\n 0 2.5 0 0 0\n"
    path = written_afni(tmp_path, timed, values)
    assert load(path, time=1).values.max() == 50
    from texvol.formats.readers import TimeSeries

    series = TimeSeries(path)
    assert series.times is not None and series.times.tolist() == [0, 2.5] and series.time_unit == "s"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (afni(DATASET_DIMENSIONS="5 4 300 0 0"), "holds 120 bytes of samples"),
        (afni(DATASET_DIMENSIONS="99999 99999 99999 0 0"), "this machine has|holds 120 bytes"),
        (afni(BRICK_TYPES="5"), "complex"),
        (afni().replace("DELTA", "OTHER"), "its header has no DELTA"),
        ("nothing", "."),
    ],
)
def test_an_afni_header_that_makes_no_sense(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(InputError, match=rf"v\+orig\.HEAD: .*({reason})"):
        load(written_afni(tmp_path, text, marked.marked("<i2")))
    (tmp_path / "v+orig.BRIK").unlink()
    with pytest.raises(InputError, match=r"half of an AFNI dataset|has no|cannot be read"):
        load(tmp_path / "v+orig.HEAD")


def written_minc1(path: Path, order: tuple[str, ...] = AXIS_NAMES, steps: tuple[float, ...] = (-4, 3, 2)) -> Path:
    """Slices with a range of their own: the stored 0 to 100 stand for 0 to 50 + slice."""
    stored = marked.marked("i2")
    with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
        for name, size, step, start in zip(order, stored.shape, steps, (30.5, -20, 10), strict=True):
            file.createDimension(name, size)
            variable = file.createVariable(name, "i4")
            variable.spacing, variable.step, variable.start = "regular__", float(step), float(start)
            direction = marked.DIRECTION[:, "xyz".index(name[0])] * (-1 if name == "zspace" else 1)
            variable.direction_cosines = direction
        image = file.createVariable("image", "i2", order)
        image.signtype, image.valid_range = "signed__", np.array([0.0, 100.0])
        image[:] = stored
        for name, values in (("image-max", 50 + np.arange(3.0)), ("image-min", np.zeros(3))):
            file.createVariable(name, "f8", order[:1])[:] = values
    return path


def test_minc_1_has_slices_of_their_own_scale(tmp_path: Path) -> None:
    path = written_minc1(tmp_path / "v.mnc")
    volume = load(path)
    wanted = marked.marked("f8") * (50 + np.arange(3)).reshape(3, 1, 1) / 100
    np.testing.assert_allclose(volume.values, wanted, rtol=1e-6)
    check_against_nibabel(volume, path)
    np.testing.assert_allclose(volume.spacing, marked.SPACING)


def test_axes_of_minc_in_another_order(tmp_path: Path) -> None:
    path = written_minc1(tmp_path / "v.mnc", ("xspace", "zspace", "yspace"), (2, -4, 3))
    check_against_nibabel(load(path), path)


def written_minc2(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        for name, size, step in zip(AXIS_NAMES, (3, 4, 5), (4.0, 3.0, 2.0), strict=True):
            scale = file.create_dataset(f"minc-2.0/dimensions/{name}", data=np.int32(0))
            scale.attrs["spacing"], scale.attrs["step"], scale.attrs["start"] = np.bytes_("regular__"), step, 7.0
            scale.attrs["length"] = np.int32(size)
        image = file.create_dataset("minc-2.0/image/0/image", data=marked.marked("i2"), chunks=(1, 4, 5), compression=4)
        image.attrs["dimorder"], image.attrs["valid_range"] = np.bytes_(",".join(AXIS_NAMES)), np.array([0.0, 100.0])
        for name, value in (("image-max", 100.0), ("image-min", 0.0)):
            file.create_dataset(f"minc-2.0/image/0/{name}", data=value)
    return path


def test_minc_2(tmp_path: Path) -> None:
    path = written_minc2(tmp_path / "v.mnc")
    volume = load(path)
    np.testing.assert_array_equal(volume.values, marked.marked())
    assert volume.values.dtype == np.int16
    check_against_nibabel(volume, path)


def without_what_may_be_absent(path: Path) -> None:
    """Write both kinds without a range of the values, with uneven time steps."""
    stored = np.stack([marked.marked("i2"), marked.marked("i2") * 0])
    names = ("time", *AXIS_NAMES)
    if path.stem == "one":
        with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
            for name, size in zip(names, stored.shape, strict=True):
                file.createDimension(name, size)
                file.createVariable(name, "i4").spacing = "irregular" if name == "time" else "regular__"
            image = file.createVariable("image", "i2", names)
            image.signtype, image.valid_range = "signed__", np.array([0.0, 200.0])
            image[:] = stored
        return
    with h5py.File(path, "w") as file:
        for name in names:
            scale = file.create_dataset(f"minc-2.0/dimensions/{name}", data=np.int32(0))
            scale.attrs["spacing"] = np.bytes_("irregular" if name == "time" else "regular__")
        image = file.create_dataset("minc-2.0/image/0/image", data=stored)
        image.attrs["dimorder"], image.attrs["valid_range"] = np.bytes_(",".join(names)), np.array([0.0, 200.0])


@pytest.mark.parametrize("name", ["one.mnc", "two.mnc"])
def test_minc_without_what_may_be_absent(tmp_path: Path, name: str) -> None:
    """The valid range stands for 0 to 1 then, as in libminc (mincextract)."""
    without_what_may_be_absent(tmp_path / name)
    np.testing.assert_allclose(load(tmp_path / name, time=0).values, marked.marked() / 200, rtol=1e-6)
    assert load(tmp_path / name, time=1).values.max() == 0


def test_a_minc_file_that_is_none(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.mnc", "w") as file:
        file["v"] = marked.marked()
    with pytest.raises(InputError, match=r"v\.mnc: "):
        load(tmp_path / "v.mnc")
    with netCDF4.Dataset(tmp_path / "flat.mnc", "w", format="NETCDF3_CLASSIC") as file:
        file.createDimension("yspace", 4)
        file.createDimension("xspace", 5)
        for each in ("yspace", "xspace"):
            file.createVariable(each, "i4").spacing = "regular__"
        file.createVariable("image", "i2", ("yspace", "xspace")).signtype = "signed__"
    with pytest.raises(InputError, match=r"must have the axes xspace, yspace and zspace, got yspace, xspace"):
        load(tmp_path / "flat.mnc")
    content = written_minc1(tmp_path / "t.mnc").read_bytes()
    (tmp_path / "t.mnc").write_bytes(content[:-130])
    with pytest.raises(InputError, match=r"t\.mnc: "):
        load(tmp_path / "t.mnc")


@pytest.mark.parametrize("dtype", ["u1", "i1", "i2", "u2", "f4", "f8"])
@pytest.mark.parametrize("ending", [".gipl", ".gipl.gz"])
def test_gipl_as_itk_writes_it(tmp_path: Path, dtype: str, ending: str) -> None:
    image = SimpleITK.GetImageFromArray(marked.marked(dtype))
    image.SetSpacing(marked.SPACING)
    image.SetOrigin(marked.ORIGIN)
    path = tmp_path / f"v{ending}"
    SimpleITK.WriteImage(image, str(path))
    read = SimpleITK.ReadImage(str(path))
    marked.check(load(path), dtype, position=read.TransformIndexToPhysicalPoint(marked.MARK), atol=1e-6)
    assert load(path).unit == "mm"


def test_a_gipl_header_that_makes_no_sense(tmp_path: Path) -> None:
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(marked.marked()), str(tmp_path / "v.gipl"))
    sound = (tmp_path / "v.gipl").read_bytes()
    for at, data, reason in (
        (4, b"\xff\xff", "holds 120 bytes of samples"),
        (8, b"\0\x63", "its image type must be one of"),
        (252, b"\0\0\0\0", "named GIPL, but its content is"),
        (10, struct.pack(">f", -1), "spacing"),
        (204, struct.pack(">d", float("nan")), "origin"),
    ):
        (tmp_path / "v.gipl").write_bytes(sound[:at] + data + sound[at + len(data) :])
        with pytest.raises(InputError, match=rf"v\.gipl: .*{reason}"):
            load(tmp_path / "v.gipl")
    (tmp_path / "v.gipl").write_bytes(sound[:100])
    with pytest.raises(InputError, match="GIPL"):
        load(tmp_path / "v.gipl")
