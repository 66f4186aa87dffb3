"""Volumes whose samples are colours: which files say so, what becomes of components, and how they are shown."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Callable
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK
import tifffile
from numpy.typing import NDArray
from support import marked
from support.dicom_files import written_series
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from texvol import InputError, Volume, load
from texvol.cli import information
from texvol.formats.readers import TimeSeries, time_steps
from texvol.scene.transfer import PRESETS, preset, proposed_for

NX, NY, NZ = marked.DIMENSIONS
ROUNDING = 2.0**-23  # of single precision, relative to 1; a rounding of the table's entry, and one of the reader's


def components(count: int, dtype: str = "u1") -> NDArray:
    """Samples without symmetry, shape (3, 4, 5, count); floats from 0 to 1."""
    rng = np.random.default_rng(3)
    if dtype[0] == "f":
        return rng.random((NZ, NY, NX, count)).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, (NZ, NY, NX, count), dtype, endpoint=True)


def decoded(encoded: NDArray) -> NDArray:
    """Linear light, by the definition of sRGB (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encoded(linear: NDArray) -> NDArray:
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)


def check(volume: Volume, samples: NDArray) -> None:
    """Fail unless the volume shows the components as they are."""
    whole = samples.dtype.kind == "u"
    fractions = samples / np.iinfo(samples.dtype).max if whole else samples.astype("f8")
    colors = decoded(fractions[..., :3]) if whole else fractions[..., :3]
    brightest = fractions[..., :3].max(axis=-1)
    amounts = fractions[..., 3] if samples.shape[-1] == 4 else brightest if whole else encoded(brightest)
    assert volume.colors is not None and volume.values.dtype == np.float32 and not volume.labels
    np.testing.assert_allclose(volume.colors, colors, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(volume.values, amounts, rtol=0, atol=ROUNDING)
    assert len(volume.notes) >= 1 and volume.notes[-1].startswith("colours (")
    assert ("opacity" in volume.notes[-1]) == (samples.shape[-1] == 4)


def as_npy(path: Path, samples: NDArray) -> Path:
    np.save(path / "v.npy", samples)
    return path / "v.npy"


def as_fortran_npy(path: Path, samples: NDArray) -> Path:
    return as_npy(path, np.asfortranarray(samples))


def as_nrrd(path: Path, samples: NDArray, kind: str = "", at: int = 0) -> Path:
    kinds = ["domain"] * 3
    kinds.insert(at, kind or ("RGB-color" if samples.shape[3] == 3 else "RGBA-color"))
    name = str(path / f"{kind or 'v'}.nrrd")
    nrrd.write(name, np.moveaxis(samples, 3, 3 - at).T, {"kinds": kinds, "encoding": "gzip"})
    return Path(name)


def as_nifti(path: Path, samples: NDArray) -> Path:
    names = "RGBA"[: samples.shape[3]]
    packed = np.ascontiguousarray(samples).view([(name, "u1") for name in names])[..., 0]
    nibabel.save(nibabel.Nifti1Image(packed.T, np.eye(4)), path / "v.nii.gz")
    return path / "v.nii.gz"


def as_nifti_vector(path: Path, samples: NDArray) -> Path:
    image = nibabel.Nifti1Image(samples.transpose(2, 1, 0, 3)[:, :, :, np.newaxis], np.eye(4))
    image.header["intent_code"] = {3: 2003, 4: 2004}[samples.shape[3]]
    nibabel.save(image, path / "vector.nii")
    return path / "vector.nii"


def as_metaimage(path: Path, samples: NDArray) -> Path:
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(samples, isVector=True), str(path / "v.mha"))
    return path / "v.mha"


def as_vti(path: Path, samples: NDArray, name: str = "values", vectors: bool = False) -> Path:
    image = vtkImageData()
    image.SetDimensions(NX, NY, NZ)
    array = numpy_to_vtk(samples.reshape(-1, samples.shape[3]), deep=True)
    array.SetName(name)
    (image.GetPointData().SetVectors if vectors else image.GetPointData().SetScalars)(array)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path / f"{name}{vectors}.vti"))
    writer.SetInputData(image)
    writer.Write()
    return path / f"{name}{vectors}.vti"


def as_tiff(path: Path, samples: NDArray, **options: object) -> Path:
    tifffile.imwrite(path / "v.tif", samples, photometric="rgb", **options)
    return path / "v.tif"


def as_separate_tiff(path: Path, samples: NDArray) -> Path:
    return as_tiff(path, np.moveaxis(samples, 3, 1), planarconfig="separate")


def as_imagej(path: Path, samples: NDArray) -> Path:
    return as_tiff(path, samples, imagej=True, metadata={"axes": "ZYXS"})


def as_ome(path: Path, samples: NDArray) -> Path:
    tifffile.imwrite(path / "v.ome.tif", samples, photometric="rgb", metadata={"axes": "ZYXS"})
    return path / "v.ome.tif"


def as_tiff_folder(path: Path, samples: NDArray) -> Path:
    (path / "folder").mkdir()
    for number, page in enumerate(samples):
        tifffile.imwrite(path / "folder" / f"{number + 9}.tif", page, photometric="rgb")
    return path / "folder"


def as_separate_tiff_folder(path: Path, samples: NDArray) -> Path:
    (path / "folder").mkdir()
    for number, page in enumerate(np.moveaxis(samples, 3, 1)):
        name = path / "folder" / f"{number + 9}.tif"
        tifffile.imwrite(name, page, photometric="rgb", planarconfig="separate")
    return path / "folder"


def as_dicom(path: Path, samples: NDArray) -> Path:
    fields = {"SamplesPerPixel": 3, "PhotometricInterpretation": "RGB", "PlanarConfiguration": 0}
    (path / "series").mkdir()
    return written_series(path / "series", values=samples, **fields)


THAT_SAY_SO: list[tuple[Callable[[Path, NDArray], Path], int, str]] = [
    *((write, count, "u1") for write in (as_nrrd, as_nifti, as_nifti_vector, as_metaimage, as_vti) for count in (3, 4)),
    *((write, count, "u1") for write in (as_tiff, as_ome, as_tiff_folder) for count in (3, 4)),
    *((write, 3, "u1") for write in (as_separate_tiff, as_imagej, as_separate_tiff_folder, as_dicom)),
    *((as_nrrd, 3, dtype) for dtype in ("u2", "f4", "f8")),
    *((as_tiff, 4, dtype) for dtype in ("u2", "f4")),
    (as_nifti_vector, 3, "f4"),
]


@pytest.mark.parametrize(("write", "count", "dtype"), THAT_SAY_SO)
def test_files_that_say_so_are_shown_as_they_are(
    tmp_path: Path, write: Callable[[Path, NDArray], Path], count: int, dtype: str
) -> None:
    samples = components(count, dtype)
    path = write(tmp_path, samples)
    check(load(path), samples)
    check(load(path, color=True), samples)
    assert load(path).source.get("color") is None and load(path, color=True).source["color"] is True
    for options in ({"color": False}, {"labels": True}):
        # A folder of colours has no channels to choose from, but slices that are no slices.
        with pytest.raises(InputError, match=rf"--channel 0\.\.{count - 1}|one channel"):
            load(path, **options)


OF_ONE_FILE = [each for each in THAT_SAY_SO if "folder" not in each[0].__name__]


@pytest.mark.parametrize(("write", "count", "dtype"), OF_ONE_FILE)
def test_a_channel_is_one_component_as_numbers(
    tmp_path: Path, write: Callable[[Path, NDArray], Path], count: int, dtype: str
) -> None:
    samples = components(count, dtype)
    path = write(tmp_path, samples)
    volume = load(path, channel=2)
    np.testing.assert_array_equal(volume.values, samples[..., 2])
    assert volume.colors is None and volume.values.dtype == np.dtype(dtype)
    with pytest.raises(InputError, match="--channel or --color"):
        load(path, channel=2, color=True)


AMBIGUOUS: list[tuple[Callable[[Path, NDArray], Path], str]] = [
    (as_npy, "u1"),
    (as_fortran_npy, "f4"),
    (as_metaimage, "f4"),
    (as_metaimage, "u2"),
    (as_vti, "f4"),
    (as_vti, "u2"),
    (lambda path, samples: as_vti(path, samples, vectors=True), "u1"),
    (lambda path, samples: as_nrrd(path, samples, "vector"), "f4"),
    (lambda path, samples: as_nrrd(path, samples, "list"), "u1"),
    (lambda path, samples: as_nrrd(path, samples, "HSV-color"), "u1"),
]


@pytest.mark.parametrize("number", range(len(AMBIGUOUS)))
def test_files_that_do_not_are_colours_when_the_user_says_so(tmp_path: Path, number: int) -> None:
    write, dtype = AMBIGUOUS[number]
    samples = components(3, dtype)
    path = write(tmp_path, samples)
    with pytest.raises(InputError, match="choose one with --channel"):
        load(path)
    check(load(path, color=True), samples)


def test_what_a_npy_may_hold_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--channel 0\.\.2, .* if its last axis is colour, give --color"):
        load(as_npy(tmp_path, components(3)))
    np.save(tmp_path / "five.npy", np.zeros((2, 3, 4, 5)))
    with pytest.raises(InputError) as caught:
        load(tmp_path / "five.npy")
    assert "--color" not in str(caught.value)


def test_vectors_of_bytes_and_arrays_named_so_are_colour(tmp_path: Path) -> None:
    check(load(as_nrrd(tmp_path, components(3), "vector")), components(3))
    check(load(as_vti(tmp_path, components(4, "f4"), "RGBA")), components(4, "f4"))


@pytest.mark.parametrize("at", [0, 1, 3])
def test_components_may_lie_along_any_axis_of_a_nrrd(tmp_path: Path, at: int) -> None:
    check(load(as_nrrd(tmp_path, components(3), "3-color", at)), components(3))


def test_channels_of_a_microscope_are_not_colours(tmp_path: Path) -> None:
    samples = components(3)
    tifffile.imwrite(tmp_path / "v.tif", np.moveaxis(samples, 3, 1), imagej=True, metadata={"axes": "ZCYX"})
    first = load(tmp_path / "v.tif")
    assert first.colors is None
    np.testing.assert_array_equal(first.values, samples[..., 0])
    check(load(tmp_path / "v.tif", color=True), samples)


def test_opacity_that_a_tiff_has_multiplied_in_is_divided_out(tmp_path: Path) -> None:
    straight = np.array([[[[255, 128, 0, 255], [255, 128, 0, 51], [9, 9, 9, 0]]]], "u1").repeat(2, axis=0)
    stored = straight.copy()
    stored[..., :3] = np.rint(straight[..., :3] * (straight[..., 3:] / 255.0))
    volume = load(as_tiff(tmp_path, stored, extrasamples=["assocalpha"]))
    assert volume.colors is not None and "divided out" in volume.notes[0]
    # A fifth of 255 has steps of 5 levels: half of one, where the curve is steepest (its slope at 1 is 2.27).
    np.testing.assert_allclose(volume.colors[..., :2, :], decoded(straight[..., :2, :3] / 255), atol=2.27 * 2.5 / 255)
    np.testing.assert_array_equal(volume.colors[..., 2, :], 0)
    np.testing.assert_allclose(volume.values, straight[..., 3] / 255, atol=ROUNDING)


def test_luminance_and_chrominance_of_a_dicom_file_become_colours(tmp_path: Path) -> None:
    # Y, CB, CR of pure red, as DICOM PS3.3 C.7.6.3.1.2 has them for YBR_FULL.
    samples = np.zeros((NZ, NY, NX, 3), "u1")
    samples[:] = 76, 85, 255
    fields = {"SamplesPerPixel": 3, "PhotometricInterpretation": "YBR_FULL", "PlanarConfiguration": 0}
    volume = load(written_series(tmp_path, values=samples, **fields))
    assert volume.colors is not None
    np.testing.assert_allclose(volume.colors, np.broadcast_to((1, 0, 0), volume.colors.shape), atol=0.02)


def test_colours_of_a_nifti_file_are_not_scaled(tmp_path: Path) -> None:
    content = bytearray(gzip.decompress(as_nifti(tmp_path, components(3)).read_bytes()))
    content[112:120] = struct.pack("<2f", 0.5, 1)  # scl_slope, scl_inter
    (tmp_path / "s.nii").write_bytes(content)
    check(load(tmp_path / "s.nii"), components(3))


def test_a_sample_that_is_not_there_has_no_colour() -> None:
    from texvol.formats.readers.colors import colored

    samples = components(4, "f4")
    samples[1, 2, 3, 0] = np.nan
    found = colored(samples, "ZYXK", [slice(None)] * 4, "")
    assert np.isnan(found["values"][1, 2, 3]) and np.isnan(found["values"]).sum() == 1
    assert Volume(found["values"], colors=found["colors"]).has_missing


@pytest.mark.parametrize(
    ("samples", "options", "message"),
    [
        (np.full((2, 3, 4, 3), 1.5, "f4"), {}, r"must be in \[0, 1\], got 1.5 to 1.5; --channel N"),
        (np.full((2, 3, 4, 4), -0.5, "f4"), {}, r"must be in \[0, 1\]"),
        (np.full((2, 3, 4, 3), np.inf), {}, r"must be in \[0, 1\]"),
        (np.zeros((2, 3, 4, 3), "i2"), {}, r"colour \(--color\) must be uint8, uint16 or floats, got int16"),
        (np.zeros((2, 3, 4, 3), "u4"), {}, "floats, got uint32"),
        (np.zeros((2, 3, 4, 2), "u1"), {}, "--color needs 3 or 4 components, and its samples have 2"),
        (np.zeros((3, 4, 3), "u1"), {}, "--color needs 3 or 4 components, and its samples are single numbers"),
        (np.zeros((2, 3, 4, 3), "u1"), {"channel": 0}, "--channel or --color"),
        (np.zeros((2, 3, 4, 3), "u1"), {"labels": True}, "--labels or --color"),
    ],
)
def test_what_is_no_colour_is_refused_in_a_line(tmp_path: Path, samples: NDArray, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        load(as_npy(tmp_path, samples), color=True, **options)
    assert "\n" not in str(caught.value)


def test_formats_without_components_are_named(tmp_path: Path) -> None:
    (tmp_path / "v.raw").write_bytes(bytes(60))
    with pytest.raises(InputError, match="is raw: --color is for the components of NRRD, NIfTI"):
        load(tmp_path / "v.raw", shape=(5, 4, 3), dtype="u1", color=True)


def test_a_folder_of_colours_and_greys_is_mixed(tmp_path: Path) -> None:
    folder = as_tiff_folder(tmp_path, components(3))
    tifffile.imwrite(folder / "99.tif", components(3)[0, ..., 0], photometric="minisblack")
    with pytest.raises(InputError, match=r"99\.tif: its slices are of mixed kinds: 9\.tif and it"):
        load(folder)


def test_time_steps_have_colours_of_their_own(tmp_path: Path) -> None:
    steps = np.stack([components(3), components(3)[::-1]])
    np.save(tmp_path / "v.npy", steps)
    packed = np.ascontiguousarray(steps).view([(name, "u1") for name in "RGB"])[..., 0]
    nibabel.save(nibabel.Nifti1Image(packed.T, np.eye(4)), tmp_path / "v.nii.gz")
    for name, options in (("v.npy", {"color": True}), ("v.nii.gz", {})):
        assert time_steps(tmp_path / name, **options) == 2
        check(load(tmp_path / name, time=1, **options), steps[1])
        with TimeSeries(tmp_path / name, **options) as series:
            for volume, samples in zip(series, steps, strict=True):
                check(volume, samples)


def test_colours_are_proposed_as_they_are() -> None:
    volume = Volume(np.linspace(0, 1, 8).reshape(2, 2, 2), (2, 2, 2), colors=np.full((2, 2, 2, 3), 0.5))
    function = proposed_for(volume)
    amounts = np.array([0, 0.25, 0.5, 1])
    np.testing.assert_array_equal(function.at(amounts)[:, :3], 1)
    assert function.classify(0).extinction == 0 and function.classify(1).extinction > 0
    np.testing.assert_allclose(function.classify(amounts).extinction, amounts * function.classify(1).extinction)


@pytest.mark.parametrize("name", [name for name in PRESETS if name != "fluorescence"])  # which emits its own colour
def test_presets_tint_colours(name: str) -> None:
    rng = np.random.default_rng(2)
    volume = Volume(rng.random((8, 8, 8), "f4"), colors=rng.random((8, 8, 8, 3)))
    function = preset(name, volume)
    assert function.shows_between(0, 1) and not function.emissive


def test_information_speaks_of_colours(tmp_path: Path) -> None:
    volume = load(as_npy(tmp_path, components(3)), color=True)
    metadata = information.metadata(volume)
    assert metadata["color"] is True and metadata["memory"]["data_bytes"] == 4 * 4 * NX * NY * NZ
    page = information.text(metadata)
    assert "colour      each sample has its own" in page and "sRGB of 8 bits" in page
    assert information.metadata(Volume(np.zeros((2, 2, 2))))["color"] is False
