"""DICOM: order, direction, scaling and choice of slices; folders that are not a volume."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from copy import deepcopy as copy_of
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK
from pydicom.dataset import Dataset
from pydicom.uid import ExplicitVRBigEndian, RLELossless
from support import marked
from support.dicom_files import AXES, POSITION, multi_frame, slice_of, written_series

from texvol import InputError, load


def test_slices_are_sorted_by_position_and_lie_where_itk_says(tmp_path: Path) -> None:
    volume = load(written_series(tmp_path))
    marked.check(volume, position=POSITION, atol=1e-6)
    assert (volume.unit, volume.space) == ("mm", "left-posterior-superior")
    names = SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(str(tmp_path))
    image = SimpleITK.ReadImage(names)
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(image), volume.values)
    position = image.TransformIndexToPhysicalPoint(marked.MARK)
    np.testing.assert_allclose(marked.found_mark(volume), position, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("fields", "dtype", "slope", "intercept"),
    [
        ({"RescaleSlope": 1, "RescaleIntercept": -1024, "BitsStored": 12, "HighBit": 11}, "i2", 1, -1024),
        ({"RescaleSlope": 2, "RescaleIntercept": 1, "PixelRepresentation": 1}, "i4", 2, 1),
        ({"RescaleSlope": 0.5, "RescaleIntercept": 1}, "f4", 0.5, 1),
    ],
)
def test_slope_and_intercept(
    tmp_path: Path, fields: dict[str, float], dtype: str, slope: float, intercept: float
) -> None:
    volume = load(written_series(tmp_path, **fields))
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.values, marked.marked("f8") * slope + intercept)


def test_slopes_that_differ_from_slice_to_slice(tmp_path: Path) -> None:
    """Positron emission tomography stores each slice with its own."""
    written_series(tmp_path)
    for path in tmp_path.iterdir():
        dataset = pydicom.dcmread(path)
        dataset.RescaleSlope, dataset.RescaleIntercept = dataset.InstanceNumber, 0
        dataset.save_as(path)
    volume = load(tmp_path)
    assert volume.values.dtype == np.float32
    np.testing.assert_array_equal(volume.values, marked.marked("f4") * np.array([1, 2, 3]).reshape(3, 1, 1))


def test_bits_beyond_the_stored_ones_are_cleared(tmp_path: Path) -> None:
    """Old scanners keep overlays there."""
    volume = load(written_series(tmp_path, values=marked.marked("u2") | 0x4000, BitsStored=12, HighBit=11))
    marked.check(volume, "u2", position=POSITION, atol=1e-6)


@pytest.mark.parametrize("syntax", [ExplicitVRBigEndian, RLELossless])
def test_transfer_syntaxes(tmp_path: Path, syntax: pydicom.uid.UID) -> None:
    written_series(tmp_path)
    for path in tmp_path.iterdir():
        dataset = pydicom.dcmread(path)
        if syntax == RLELossless:
            dataset.compress(RLELossless)
            dataset.save_as(path)
        else:
            dataset.PixelData = dataset.pixel_array.astype(">i2").tobytes()
            dataset.file_meta.TransferSyntaxUID = syntax
            pydicom.dcmwrite(path, dataset, implicit_vr=False, little_endian=False)
    marked.check(load(tmp_path), position=POSITION, atol=1e-6)


@pytest.mark.parametrize("compressor", ["JPEG", "JPEG2000"])
def test_pixels_packed_without_loss(tmp_path: Path, compressor: str) -> None:
    pytest.importorskip("gdcm")
    values = np.arange(64 * 48, dtype="i2").reshape(1, 48, 64)
    path = tmp_path / "v.dcm"
    writer = SimpleITK.ImageFileWriter()
    writer.SetFileName(str(path))
    writer.SetImageIO("GDCMImageIO")
    writer.SetUseCompression(True)
    writer.SetCompressor(compressor)
    writer.Execute(SimpleITK.GetImageFromArray(values))
    dataset = pydicom.dcmread(path)
    assert dataset.file_meta.TransferSyntaxUID.is_compressed
    dataset.ImagePositionPatient, dataset.ImageOrientationPatient = [0, 0, 0], [1, 0, 0, 0, 1, 0]
    dataset.PixelSpacing = [1, 1]
    dataset.save_as(path)
    np.testing.assert_array_equal(load(path).values, values)


def test_a_tilted_gantry_shears_the_axes(tmp_path: Path) -> None:
    step = np.cross(*AXES) * 4 + AXES[1] * 1.5
    volume = load(written_series(tmp_path, step=step))
    np.testing.assert_allclose(volume.world_from_index[:, 2], step, atol=1e-6)
    np.testing.assert_array_equal(volume.values, marked.marked())


def test_one_slice_is_a_volume_as_thick_as_it_says(tmp_path: Path) -> None:
    written_series(tmp_path)
    volume = load(next(tmp_path.iterdir()))
    assert volume.dimensions == (5, 4, 1)
    np.testing.assert_allclose(volume.spacing, marked.SPACING)


@pytest.mark.parametrize("enhanced", [False, True])
def test_frames_of_one_file(tmp_path: Path, enhanced: bool) -> None:
    multi_frame(tmp_path / "v.dcm", enhanced=enhanced)
    marked.check(load(tmp_path / "v.dcm"), position=POSITION, atol=1e-6)


@pytest.mark.parametrize("name", ["FloatPixelData", "DoubleFloatPixelData"])
def test_parametric_maps_have_floats(tmp_path: Path, name: str) -> None:
    """Their fractions, and their padding, which is a float as well, are kept."""
    multi_frame(tmp_path / "v.dcm", enhanced=True)
    dataset = pydicom.dcmread(tmp_path / "v.dcm")
    dataset.SOPClassUID = dataset.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.30"
    del dataset.PixelData, dataset.BitsStored, dataset.HighBit, dataset.PixelRepresentation
    values = marked.marked("f8" if name.startswith("D") else "f4") / 7
    dataset.BitsAllocated = 8 * values.itemsize
    setattr(dataset, name, values[::-1].tobytes())
    setattr(dataset, name.replace("Data", "PaddingValue"), float(values[0, 0, 1]))
    dataset.save_as(tmp_path / "v.dcm")
    volume = load(tmp_path / "v.dcm")
    assert np.isnan(volume.values[0, 0, 1]) and volume.values.dtype == values.dtype
    expected = np.where(values == values[0, 0, 1], np.nan, values)
    np.testing.assert_array_equal(volume.values, expected)


@pytest.mark.parametrize("told", ["DiffusionBValue", "EffectiveEchoTime", "DimensionIndexValues"])
def test_frames_of_one_file_at_the_same_places(tmp_path: Path, told: str) -> None:
    """Datasets of an enhanced file with two weightings, the second one first."""
    groups = {"DiffusionBValue": "MRDiffusionSequence", "EffectiveEchoTime": "MREchoSequence"}
    multi_frame(tmp_path / "v.dcm", enhanced=True)
    dataset = pydicom.dcmread(tmp_path / "v.dcm")
    frames = []
    for step in (1, 0):
        for number, one in enumerate(dataset.PerFrameFunctionalGroupsSequence):
            frame, group = copy_of(one), Dataset()
            setattr(group, told, [1, 3 - number, step + 1] if told == "DimensionIndexValues" else 100.0 * step)
            setattr(frame, groups.get(told, "FrameContentSequence"), [group])
            frames.append(frame)
    dataset.PerFrameFunctionalGroupsSequence, dataset.NumberOfFrames = frames, 6
    dataset.PixelData = (marked.marked()[::-1].tobytes()) + (marked.marked()[::-1] * 0).tobytes()
    dataset.save_as(tmp_path / "v.dcm")
    marked.check(load(tmp_path / "v.dcm", time=1), position=POSITION, atol=1e-6)
    assert load(tmp_path / "v.dcm", time=0).values.max() == 0


def test_other_files_and_objects_are_passed_over(tmp_path: Path) -> None:
    written_series(tmp_path)
    (tmp_path / "notes.txt").write_text("nothing to see")
    report = slice_of(0)
    report.SOPClassUID = report.file_meta.MediaStorageSOPClassUID = pydicom.uid.BasicTextSRStorage
    for key in ("Rows", "Columns", "PixelData"):
        delattr(report, key)
    report.save_as(tmp_path / "report.dcm", enforce_file_format=True)
    marked.check(load(tmp_path), position=POSITION, atol=1e-6)


def test_several_series_need_a_choice(tmp_path: Path) -> None:
    written_series(tmp_path, SeriesDescription="Bone", SeriesNumber=3)
    written_series(tmp_path, values=marked.marked() * 0, SeriesDescription="Soft tissue", SeriesNumber=12, uid="2.5.7")
    with pytest.raises(InputError, match=r"2 series; choose one with --series: 3 'Bone' \(3 files\); 12 'Soft tissue'"):
        load(tmp_path)
    for wanted in ("3", 3, "Bone", "bone"):
        marked.check(load(tmp_path, series=wanted), position=POSITION, atol=1e-6)
    assert load(tmp_path, series="2.5.7").values.max() == 0
    with pytest.raises(InputError, match="no series 4; it has 3 'Bone'"):
        load(tmp_path, series="4")


def test_a_description_that_fits_two_series_is_refused(tmp_path: Path) -> None:
    for uid in ("2.5.7", "2.5.8"):
        written_series(tmp_path, SeriesDescription="Bone", SeriesNumber=3, uid=uid)
    with pytest.raises(InputError, match=r"matches 2 series; choose by UID: 2\.5\.7, 2\.5\.8"):
        load(tmp_path, series="3")


def test_time_steps_at_the_same_places(tmp_path: Path) -> None:
    written_series(tmp_path, values=marked.marked() * 0, TemporalPositionIdentifier=1)
    written_series(tmp_path, TemporalPositionIdentifier=2)
    with pytest.raises(InputError, match=r"duplicate slices: 2 at each of 3 places.*--time 0\.\.1"):
        load(tmp_path)
    marked.check(load(tmp_path, time=1), position=POSITION, atol=1e-6)
    with pytest.raises(InputError, match=r"--time must be in 0\.\.1, got 2"):
        load(tmp_path, time=2)


def test_colours_that_are_not_wanted_as_such_need_a_channel(tmp_path: Path) -> None:
    colours = np.stack([marked.marked("u1") * 0, marked.marked("u1"), marked.marked("u1") * 0], axis=3)
    fields = {"SamplesPerPixel": 3, "PhotometricInterpretation": "RGB", "PlanarConfiguration": 0}
    written_series(tmp_path, values=colours, **fields)
    marked.check(load(tmp_path, channel=1), "u1", position=POSITION, atol=1e-6)
    with pytest.raises(InputError, match=r"--channel 0\.\.2"):
        load(tmp_path, color=False)


def change(number: int, **fields: object) -> Callable[[Path], None]:
    """Set fields of one slice; None takes one away."""

    def changed(folder: Path) -> None:
        path = sorted(folder.iterdir())[number]
        dataset = pydicom.dcmread(path)
        for key, value in fields.items():
            if value is None:
                delattr(dataset, key)
            else:
                setattr(dataset, key, value)
        dataset.save_as(path)

    return changed


def remove(number: int) -> Callable[[Path], None]:
    return lambda folder: sorted(folder.iterdir())[number].unlink()


def cut(number: int, length: int) -> Callable[[Path], None]:
    def cut_off(folder: Path) -> None:
        path = sorted(folder.iterdir())[number]
        path.write_bytes(path.read_bytes()[:length])

    return cut_off


def copy(number: int) -> Callable[[Path], object]:
    return lambda folder: shutil.copy(sorted(folder.iterdir())[number], folder / "copy.dcm")


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (remove(3), "missing: 8 mm between .* where 4 mm"),
        (copy(1), "duplicate slices"),
        (change(1, Rows=2, Columns=10), "mixed sizes"),
        (change(1, PixelSpacing=[1, 1]), "mixed pixel spacing"),
        (change(1, ImageOrientationPatient=[1, 0, 0, 0, 1, 0]), "mixed directions"),
        (change(1, PixelRepresentation=0), "mixed types"),
        (change(1, Rows=40), "mixed sizes"),
        (change(1, Rows=0), "positive"),
        (change(0, Rows=60000, Columns=60000, NumberOfFrames=400), "this machine has"),
        (change(0, NumberOfFrames=10**8), "NumberOfFrames"),
        (change(1, PixelData=None), "pixels can't be read"),
        (change(1, ImagePositionPatient=None), "no ImagePositionPatient"),
        (change(1, ImageOrientationPatient=[0, 0, 0, 0, 1, 0]), "singular"),
        (change(1, ImageOrientationPatient=[1, 0, 0, 1, 0, 0]), "singular"),
        (change(1, PixelSpacing=None), "no PixelSpacing"),
        (change(1, PixelSpacing=[0, 1]), "spacing must be positive"),
        (change(1, PixelSpacing=[-1, 1]), "spacing must be positive"),
        (change(1, RescaleSlope=0), "RescaleSlope must not be 0"),
        (change(1, PhotometricInterpretation="PALETTE COLOR"), "palette"),
        (change(1, BitsAllocated=12), "BitsAllocated must be 8, 16 or 32, got 12"),
        (change(1, BitsStored=17), "bits stored"),
        (cut(1, 300), "corrupt"),
        (cut(1, 600), "pixels can't be read"),
        (cut(1, -20), "pixels can't be read"),
    ],
)
def test_a_folder_that_is_no_volume_is_refused(tmp_path: Path, spoil: Callable[[Path], object], reason: str) -> None:
    folder = tmp_path / "series"
    folder.mkdir()
    written_series(folder, values=np.concatenate([marked.marked()] * 2), RescaleSlope=1, RescaleIntercept=0)
    spoil(folder)
    with pytest.raises(InputError, match=rf"series: .*{reason}"):
        load(folder)


def test_a_preamble_with_the_mark_of_tiff(tmp_path: Path) -> None:
    """DICOM leaves the first 128 bytes to other formats: a file may be both."""
    written_series(tmp_path)
    for path in tmp_path.iterdir():
        path.write_bytes(b"II*\0" + path.read_bytes()[4:])
    assert load(next(iter(sorted(tmp_path.iterdir())))).shape[0] == 1
    marked.check(load(tmp_path), position=POSITION, atol=1e-6)
