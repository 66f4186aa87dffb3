"""Bad files, of every format: one line that names the file, in little time and memory, and nothing on stderr."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import mrcfile
import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK
import tifffile
from support import grid_files, marked, mesh_files
from support.dicom_files import slice_of
from support.grid_files import points_of_axes, rectilinear, structured, written
from support.refusal import refused, told_well
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from texvol import InputError, TexvolError, load


def write_npy(path: Path) -> None:
    np.save(path, marked.marked())


def write_nrrd(path: Path) -> None:
    nrrd.write(str(path), marked.marked().T, {"encoding": "gzip" if "gz" in path.name else "raw"})


def write_nifti(path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(marked.marked().T, np.eye(4)), path)


def write_metaimage(path: Path) -> None:
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(marked.marked()), str(path), useCompression="z" in path.name)


def write_mrc(path: Path) -> None:
    with mrcfile.new(path, compression="gzip" if path.suffix == ".gz" else None) as file:
        file.set_data(marked.marked())
        file.set_volume()


def write_tiff(path: Path) -> None:
    kind = "zlib" if "z" in path.name else None
    tifffile.imwrite(path, marked.marked(), photometric="minisblack", compression=kind)


def write_vti(path: Path) -> None:
    image = vtkImageData()
    image.SetDimensions(marked.DIMENSIONS)
    image.GetPointData().SetScalars(numpy_to_vtk(marked.marked().ravel(), deep=True))
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.Write()


def write_vtr(path: Path) -> None:
    written(path, rectilinear([np.arange(size) for size in marked.DIMENSIONS], marked.marked()))


def write_vts(path: Path) -> None:
    points = points_of_axes([np.arange(size) for size in marked.DIMENSIONS])
    written(path, structured(points, marked.marked()), "appended" if "raw" in path.name else "binary", base64=0)


def write_vtu(path: Path) -> None:
    points, cells = mesh_files.hexahedra(np.array(marked.DIMENSIONS) - 1)
    mesh_files.written(path, mesh_files.unstructured(points, [(mesh_files.HEXAHEDRON, cells)], marked.marked().ravel()))


def write_netcdf(path: Path) -> None:
    axes = [("z", np.arange(3.0), "m"), ("y", np.arange(4.0), "m"), ("x", np.arange(5.0), "m")]
    form = {".nc": "NETCDF3_CLASSIC", ".nc4": "NETCDF4", ".cdf": "NETCDF3_64BIT_DATA"}[path.suffix]
    grid_files.write_netcdf(path, marked.marked(), axes, form=form)


def write_dicom(path: Path) -> None:
    slice_of(0).save_as(path, enforce_file_format=True)


WRITERS: dict[str, Callable[[Path], None]] = {
    "v.npy": write_npy,
    "v.nrrd": write_nrrd,
    "gz.nrrd": write_nrrd,
    "v.nii": write_nifti,
    "v.nii.gz": write_nifti,
    "v.mha": write_metaimage,
    "z.mha": write_metaimage,
    "v.mrc": write_mrc,
    "v.map.gz": write_mrc,
    "v.tif": write_tiff,
    "z.tif": write_tiff,
    "v.vti": write_vti,
    "v.vtr": write_vtr,
    "v.vts": write_vts,
    "raw.vts": write_vts,
    "v.vtu": write_vtu,
    "v.nc": write_netcdf,
    "v.nc4": write_netcdf,
    "v.cdf": write_netcdf,
    "v.dcm": write_dicom,
}
ALL = pytest.mark.parametrize("name", WRITERS)


@ALL
def test_the_unspoilt_file_is_read(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    WRITERS[name](tmp_path / name)
    assert load(tmp_path / name).values.max() > 0
    assert capfd.readouterr().err == ""


@ALL
def test_a_missing_file(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert refused(tmp_path / name, capfd).endswith(": no such file")


@ALL
def test_an_empty_file(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).touch()
    assert refused(tmp_path / name, capfd).endswith(": is empty")


@ALL
def test_a_truncated_file(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    content = path.read_bytes()
    for length in [1, 4, *np.linspace(8, len(content) - 3, 12).astype(int)]:
        path.write_bytes(content[:length])
        try:
            volume = load(path)
        except InputError as error:
            told_well(error, path, capfd)
        else:  # what is gone held no sample: padding, a closing tag
            np.testing.assert_array_equal(volume.values, marked.marked(), err_msg=str(length))
            assert length > 0.7 * len(content)


@ALL
@pytest.mark.parametrize(
    "other", ["v.npy", "v.nrrd", "v.nii.gz", "v.mha", "v.tif", "v.vti", "v.vtr", "v.nc", "v.dcm", "text", "noise"]
)
def test_a_file_of_another_format_than_its_name_says(
    tmp_path: Path, name: str, other: str, capfd: pytest.CaptureFixture[str]
) -> None:
    if WRITERS[name] is WRITERS.get(other):
        return  # the same format
    source = tmp_path / f"other-{other}"
    if other in WRITERS:
        WRITERS[other](source)
    else:
        source.write_bytes(b"Lorem ipsum\n" * 99 if other == "text" else Random(1).randbytes(2000))
    source.rename(tmp_path / name)
    message = refused(tmp_path / name, capfd)
    assert "named" in message or "not MRC" in message or "not DICOM" in message or "corrupt" in message


@ALL
def test_a_corrupt_file_is_read_or_refused(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    """A damaged sample can't be told from another one; what must not happen is anything but these two."""
    path = tmp_path / name
    WRITERS[name](path)
    content = path.read_bytes()
    for seed in range(18):  # scripts/fuzz.py and its test damage far more of them
        random, damaged = Random(seed), bytearray(content)
        reach = len(damaged) if seed % 2 else min(len(damaged), 1500)  # headers are where the harm is
        for _ in range(random.randrange(1, 5)):
            damaged[random.randrange(reach)] = (
                random.choice(b"0123456789-\0\xff") if seed % 3 else random.randrange(256)
            )
        path.write_bytes(damaged)
        try:
            load(path)
        except TexvolError as error:
            assert "\n" not in str(error), seed
            assert path.name in str(error), seed
        assert capfd.readouterr().err == "", seed


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("v.png", "PNG"),
        ("v.npz", "NPZ"),
    ],
)
def test_formats_that_are_not_read_are_refused_by_name(
    tmp_path: Path, name: str, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(b"whatever")
    assert f"is {kind}" in (message := refused(tmp_path / name, capfd))
    assert "texvol reads" in message
    assert all(each in message for each in ("NRRD", "NIfTI", "DICOM", "TIFF", "OpenVDB", "VTI", "netCDF", "Imaris"))


def test_an_unknown_format_is_refused_with_the_list(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "v.xyz").write_bytes(bytes(range(256)))
    assert "texvol reads NRRD, NIfTI" in refused(tmp_path / "v.xyz", capfd)


@pytest.mark.parametrize("shape", [(5, 4, 2), (5, 4, 4), (0, 4, 3), (-5, 4, -3), (5, 4), (2**40, 2**40, 2**40)])
def test_a_raw_file_of_another_size(tmp_path: Path, shape: tuple[int, ...], capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "v.raw").write_bytes(marked.marked().tobytes())
    message = refused(tmp_path / "v.raw", capfd, shape=shape, dtype="int16")
    if shape[:2] == (5, 4) and len(shape) == 3:
        assert "holds 120 bytes" in message
        assert f"need {shape[2] * 40}" in message


@pytest.mark.parametrize("dtype", ["uint16be", "complex64", "O", "U4", "f16", "i2,i4", "", "V3", "M8[s]"])
def test_a_raw_type_that_is_no_number(tmp_path: Path, dtype: str, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "v.raw").write_bytes(bytes(960))
    refused(tmp_path / "v.raw", capfd, shape=marked.DIMENSIONS, dtype=dtype)


@pytest.mark.parametrize("spacing", [(1, 0, 1), (1, -1, 1), (1, np.nan, 1), (np.inf, 1, 1), (1, 1)])
def test_a_spacing_that_is_none(tmp_path: Path, spacing: tuple, capfd: pytest.CaptureFixture[str]) -> None:
    write_npy(tmp_path / "v.npy")
    assert "spacing" in refused(tmp_path / "v.npy", capfd, spacing=spacing)


class Exploding:
    """Opens a file to write when it is unpickled."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple:
        return open, (self.path, "w")


def test_objects_are_never_unpickled(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    values = np.full((3, 4, 5), Exploding(str(tmp_path / "exploded")), dtype=object)
    np.save(tmp_path / "v.npy", values, allow_pickle=True)
    assert "never unpickled" in refused(tmp_path / "v.npy", capfd)
    assert not (tmp_path / "exploded").exists()


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.zeros((3, 4, 5), "c8"), "complex"),
        (np.zeros((3, 4, 5), "U3"), "type <U3"),
        (np.zeros((3, 4, 5), [("a", "f4"), ("b", "f4")]), "real numbers"),
        (np.zeros((4, 5)), r"must have 3 axes, got 2 (5 x 4)"),
        (np.zeros(4), "must have 3 axes, got 1 (4)"),
        (np.zeros(()), "must have 3 axes, got 0"),
        (np.zeros((2, 3, 4, 5)), "--channel 0..1"),
        (np.zeros((0, 4, 5)), "positive"),
    ],
)
def test_arrays_that_are_no_volume(
    tmp_path: Path, values: np.ndarray, reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "v.npy", values)
    assert reason in refused(tmp_path / "v.npy", capfd)


def test_folders_that_are_no_volume(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert "without files" in refused(tmp_path, capfd)
    (tmp_path / "notes.txt").write_text("nothing")
    assert "without a DICOM or TIFF slice" in refused(tmp_path, capfd)
    (tmp_path / "broken.dcm").write_bytes(b"nothing")
    assert "broken.dcm" in refused(tmp_path, capfd)
    write_tiff(tmp_path / "v.tif")
    assert "must hold DICOM or TIFF files" in refused(tmp_path, capfd)
    (tmp_path / "v.nrrd").mkdir()
    refused(tmp_path / "v.nrrd", capfd)


def test_a_pipe_is_not_waited_for(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "v.npy")
    assert "not a regular file" in refused(tmp_path / "v.npy", capfd)


@pytest.mark.parametrize("name", ["v.npy", "v.nrrd", "v.nii", "v.tif"])
def test_a_file_that_may_not_be_read(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """`open` is made to refuse, since it does not refuse root."""
    WRITERS[name](tmp_path / name)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    assert "Permission denied" in refused(tmp_path / name, capfd)


def test_memory_that_runs_out_is_an_input_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    write_npy(tmp_path / "v.npy")

    def fail(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("numpy.fromfile", fail)
    assert "more memory" in refused(tmp_path / "v.npy", capfd)


def test_an_interrupt_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_npy(tmp_path / "v.npy")

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("numpy.fromfile", interrupt)
    with pytest.raises(KeyboardInterrupt):
        load(tmp_path / "v.npy")
