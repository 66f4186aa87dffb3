"""Segmentations: layers of .seg.nrrd, DICOM SEG of bits, fractions and numbers, and tables of BIDS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nrrd
import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.dataset import Dataset
from support import marked
from support.dicom_files import AXES, NORMAL, slice_of

from texvol import InputError, load
from texvol.__main__ import main
from texvol.formats.readers.segment_tables import segments_of
from texvol.scene.label_names import names_of, table_of
from texvol.util.color import linear_from_srgb

_SEGMENTATION, _LABEL_MAP = "1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"
HEAD = np.zeros((4, 5, 6), bool)
HEAD[1:3, 1:4, 1:5] = True
MASS = np.zeros_like(HEAD)
MASS[2, 2:5, 2:4] = True


def written_nrrd(path: Path, layers: NDArray, *segments: tuple[int, int, str]) -> Path:
    """A .seg.nrrd as 3D Slicer writes it; segments have a layer, a number and a name."""
    header: dict[str, Any] = {
        "space": "left-posterior-superior",
        "space directions": np.vstack([np.full(3, np.nan), (marked.DIRECTION * marked.SPACING).T]),
        "space origin": np.array(marked.ORIGIN),
        "kinds": ["list", "domain", "domain", "domain"],
        "encoding": "gzip",
    }
    for number, (layer, value, name) in enumerate(segments):
        header |= {f"Segment{number}_LabelValue": str(value), f"Segment{number}_Layer": str(layer)}
        header |= {f"Segment{number}_Name": name, f"Segment{number}_Color": "0.5 0.25 1"}
    if layers.ndim == 3:
        header |= {"kinds": header["kinds"][1:], "space directions": header["space directions"][1:]}
        nrrd.write(str(path), layers.T, header)
    else:
        nrrd.write(str(path), np.moveaxis(layers, 0, 3).T, header)
    return path


def test_layers_become_one_number_for_each_sample(tmp_path: Path) -> None:
    path = written_nrrd(tmp_path / "s.seg.nrrd", np.stack([HEAD, MASS]).astype("u1"), (0, 1, "Head"), (1, 1, "Mass"))
    volume = load(path)
    np.testing.assert_array_equal(volume.values, np.where(MASS, 2, HEAD))
    assert volume.labels
    np.testing.assert_allclose(volume.origin, marked.ORIGIN)
    np.testing.assert_allclose(volume.world_from_index, marked.DIRECTION * marked.SPACING, atol=1e-9)
    assert "segments: 1 Head, 2 Mass" in volume.notes
    assert any(f"{int((HEAD & MASS).sum())} samples are in several segments" in note for note in volume.notes)
    np.testing.assert_array_equal(load(path, channel=1).values, MASS)
    first, second = segments_of(path)
    assert (first.label, first.name, second.label, second.name) == (1, "Head", 2, "Mass")
    np.testing.assert_allclose(first.color or (), linear_from_srgb(np.array([0.5, 0.25, 1])))


def test_labels_have_the_names_and_colours_of_their_segments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written_nrrd(
        tmp_path / "s.seg.nrrd", np.stack([HEAD, 4 * MASS]).astype("u1"), (0, 1, "Head"), (1, 4, "Mass")
    )
    color = linear_from_srgb(np.array([0.5, 0.25, 1])).tolist()
    volume = load(path)
    assert names_of(volume, [0, 1, 4]) == {1: "Head", 4: "Mass"}
    table = table_of(volume)
    assert table is not None and [table.entries[label].color for label in (1, 4)] == [tuple(color)] * 2
    assert main(["info", str(path)]) == 0
    assert f"2 have names, from {path}" in capsys.readouterr().out
    # Of one layer they are those of its segments, by the numbers that are stored.
    twice = written_nrrd(tmp_path / "t.seg.nrrd", np.stack([HEAD, MASS]).astype("u1"), (0, 1, "Head"), (1, 1, "Mass"))
    assert names_of(load(twice, channel=1), [1, 2]) == {1: "Mass"}
    one = written_nrrd(tmp_path / "u.seg.nrrd", (HEAD * 3 + MASS * 4).astype("u1"), (0, 3, "Head"), (0, 7, "Mass"))
    assert names_of(load(one), [3, 7]) == {3: "Head", 7: "Mass"}
    # A table that is asked for comes first, one that lies beside the file does not.
    (tmp_path / "s.seg.txt").write_text("1 skull\n4 tumour\n")
    assert names_of(load(path), [1, 4]) == {1: "Head", 4: "Mass"}
    assert names_of(load(path, label_names=tmp_path / "s.seg.txt"), [1, 4]) == {1: "skull", 4: "tumour"}
    assert names_of(load(path, label_names="none"), [1, 4]) == {}


def test_numbers_that_differ_stay(tmp_path: Path) -> None:
    one = written_nrrd(tmp_path / "a.seg.nrrd", (HEAD * 3 + MASS * 4).astype("u1"), (0, 3, "Head"), (0, 7, "Mass"))
    np.testing.assert_array_equal(load(one).values, HEAD * 3 + MASS * 4)
    assert load(one).labels and [each.label for each in segments_of(one)] == [3, 7]
    layers = np.stack([HEAD * 3, MASS * 7]).astype("u1")
    several = written_nrrd(tmp_path / "b.seg.nrrd", layers, (0, 3, "Head"), (1, 7, "Mass"))
    np.testing.assert_array_equal(load(several).values, np.where(MASS, 7, HEAD * 3))


def test_a_segment_in_no_layer_is_refused(tmp_path: Path) -> None:
    path = written_nrrd(tmp_path / "s.seg.nrrd", np.stack([HEAD, MASS]).astype("u1"), (0, 1, "Head"), (5, 1, "Mass"))
    with pytest.raises(InputError, match="segment 'Mass' must be in one of 2 layers, got 5"):
        load(path)
    path = written_nrrd(tmp_path / "t.seg.nrrd", np.stack([HEAD, MASS]).astype("u1"), (0, 1, "Head"))
    path.write_bytes(path.read_bytes().replace(b"Segment0_Layer:=0", b"Segment0_Layer:=x"))
    with pytest.raises(InputError, match="Segment0_Layer must be a whole number, got 'x'"):
        load(path)


def written_dicom(path: Path, kind: str, planes: NDArray, frames: list[tuple[int, int]], **fields: Any) -> Path:
    """A DICOM SEG; frames have a segment and a number of the slice."""
    dataset = slice_of(0, planes[0])
    uid = _LABEL_MAP if kind == "LABELMAP" else _SEGMENTATION
    dataset.SOPClassUID = dataset.file_meta.MediaStorageSOPClassUID = pydicom.uid.UID(uid)
    dataset.Modality, dataset.SegmentationType = "SEG", kind
    dataset.NumberOfFrames = len(frames)
    dataset.Rows, dataset.Columns = planes.shape[1:]
    dataset.PixelData = planes.tobytes()
    if kind == "BINARY":
        dataset.BitsAllocated, dataset.BitsStored, dataset.HighBit = 1, 1, 0
        packed = np.packbits(planes.ravel(), bitorder="little").tobytes()
        dataset.PixelData = packed + bytes(len(packed) % 2)
    dataset.SegmentSequence = []
    for number, name in ((1, "Head"), (2, "Mass")):
        segment = Dataset()
        segment.SegmentNumber, segment.SegmentLabel = number, name
        segment.RecommendedDisplayCIELabValue = [35579, 53664, 50858]  # red under D50: L 54.29, a 80.81, b 69.89
        dataset.SegmentSequence.append(segment)
    shared, orientation, measures = Dataset(), Dataset(), Dataset()
    orientation.ImageOrientationPatient = dataset.ImageOrientationPatient
    measures.PixelSpacing, measures.SliceThickness = dataset.PixelSpacing, marked.SPACING[2]
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [orientation], [measures]
    dataset.SharedFunctionalGroupsSequence = [shared]
    dataset.PerFrameFunctionalGroupsSequence = [_frame(segment, place) for segment, place in frames]
    for key in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness"):
        delattr(dataset, key)
    for key, value in fields.items():
        setattr(dataset, key, value)
    pydicom.dcmwrite(path, dataset, enforce_file_format=True)
    return path


def _frame(segment: int, place: int) -> Dataset:
    frame, plane, named = Dataset(), Dataset(), Dataset()
    position = np.array(marked.ORIGIN) + NORMAL * marked.SPACING[2] * place
    plane.ImagePositionPatient = [f"{each:.10g}" for each in position]
    named.ReferencedSegmentNumber = segment
    frame.PlanePositionSequence, frame.SegmentIdentificationSequence = [plane], [named]
    return frame


FRAMES = [(2, 2), (1, 2), (1, 1)]  # in no order, and without those where a segment has nothing
PLANES = np.array([MASS[2], HEAD[2], HEAD[1]])


def check_place(volume: Any, first: int) -> None:
    columns = np.column_stack([*AXES, NORMAL]) * marked.SPACING
    np.testing.assert_allclose(volume.world_from_index, columns, atol=1e-6)
    np.testing.assert_allclose(volume.origin, np.array(marked.ORIGIN) + columns[:, 2] * first, atol=1e-6)
    assert (volume.unit, volume.space) == ("mm", "left-posterior-superior")


def test_segments_of_bits(tmp_path: Path) -> None:
    """30 bits a frame: frames begin within bytes."""
    path = written_dicom(tmp_path / "s.dcm", "BINARY", PLANES.astype("u1"), FRAMES)
    volume = load(path)
    np.testing.assert_array_equal(volume.values, np.where(MASS, 2, HEAD)[1:3])
    assert volume.labels and "segments: 1 Head, 2 Mass" in volume.notes
    assert names_of(volume, [1, 2]) == {1: "Head", 2: "Mass"}
    check_place(volume, 1)
    assert any(f"{int((HEAD & MASS).sum())} samples are in several segments" in note for note in volume.notes)
    np.testing.assert_array_equal(load(path, channel=0).values, HEAD[1:3])
    with pytest.raises(InputError, match=r"--channel must be in 0\.\.1, got 2"):
        load(path, channel=2)
    found = segments_of(path)
    assert [(each.label, each.name) for each in found] == [(1, "Head"), (2, "Mass")]
    np.testing.assert_allclose(found[0].color or (), [1, 0, 0], atol=0.01)


def test_positions_without_a_frame_have_no_segment(tmp_path: Path) -> None:
    path = written_dicom(tmp_path / "s.dcm", "BINARY", PLANES.astype("u1"), [(1, 0), (1, 1), (1, 5)])
    volume = load(path)
    assert volume.dimensions == (6, 5, 6)
    assert not volume.values[2:5].any() and volume.values[5].any()
    path = written_dicom(tmp_path / "s.dcm", "BINARY", PLANES.astype("u1"), [(1, 0), (1, 2), (1, 5)])
    with pytest.raises(InputError, match="whole multiples of one distance"):
        load(path)


def test_fractions_of_one_segment(tmp_path: Path) -> None:
    path = written_dicom(
        tmp_path / "s.dcm", "FRACTIONAL", PLANES.astype("u1") * 100, FRAMES, MaximumFractionalValue=200
    )
    with pytest.raises(InputError, match=r"--channel 0\.\.1"):
        load(path)
    volume = load(path, channel=1)
    np.testing.assert_array_equal(volume.values, MASS[1:3] * np.float32(0.5))
    assert not volume.labels
    check_place(volume, 1)


def test_a_map_of_labels(tmp_path: Path) -> None:
    planes = np.where(MASS, 2, HEAD)[1:3].astype("u1")
    volume = load(written_dicom(tmp_path / "s.dcm", "LABELMAP", planes, [(0, 1), (0, 2)]))
    np.testing.assert_array_equal(volume.values, planes)
    assert volume.labels and names_of(volume, [1, 2]) == {1: "Head", 2: "Mass"}
    check_place(volume, 1)


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"NumberOfFrames": 10**7}, "bits need"),
        ({"BitsAllocated": 8}, "BitsAllocated of a BINARY segmentation must be 1, got 8"),
        ({"SegmentationType": "OTHER"}, "SegmentationType must be BINARY, FRACTIONAL or LABELMAP"),
        ({"SegmentSequence": []}, "has no segment"),
        ({"PixelData": bytes(2)}, "its pixels hold 2 bytes, but its frames need 12"),
        ({"PerFrameFunctionalGroupsSequence": []}, "no ImagePositionPatient"),
    ],
)
def test_a_segmentation_that_makes_no_sense_is_refused(tmp_path: Path, fields: dict[str, Any], reason: str) -> None:
    path = written_dicom(tmp_path / "s.dcm", "BINARY", PLANES.astype("u1"), FRAMES, **fields)
    with pytest.raises(InputError, match=rf"s\.dcm: .*{reason}"):
        load(path)


def test_a_table_of_bids(tmp_path: Path) -> None:
    path = tmp_path / "dseg.tsv"
    path.write_text("index\tname\tabbreviation\tcolor\n1\tGray Matter\tGM\t#ff0000\n17\tOther\tO\tn/a\n")
    first, second = segments_of(path)
    assert (first.label, first.name, first.color) == (1, "Gray Matter", (1, 0, 0))
    assert (second.label, second.name, second.color) == (17, "Other", None)
    for text, reason in (
        ("label\tname\n1\ta\n", "must have columns index and name, separated by tabs, got label, name"),
        ("index\tname\none\ta\n", "index in line 2 must be a whole number, got 'one'"),
        ("index\tname\n1\ta\n1\tb\n", "index 1 must be given once, got it again in line 3"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=reason):
            segments_of(path)
