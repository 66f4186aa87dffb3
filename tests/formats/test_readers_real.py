"""The real volumes: dimensions, type, range, spacing and place of each, as its source states them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from support.real_data import real_volume

from texvol import InputError, Volume, load

LPS, RAS = "left-posterior-superior", "right-anterior-superior"


class Known(NamedTuple):
    """What a real volume is known to be."""

    file: str
    dimensions: tuple[int, int, int]
    dtype: str
    value_range: tuple[float, float]
    spacing: tuple[float, float, float] = (1, 1, 1)
    unit: str = ""
    space: str = ""
    options: dict[str, Any] = {}  # noqa: RUF012  never changed


MALE = {"shape": (128, 256, 256), "dtype": "uint8", "spacing": (1.5777, 0.99586, 1.008)}
NUCLEUS = (0.511878, 0.511878, 0.499413)
KNOWN = [
    Known("male/male.raw.bz2", (128, 256, 256), "uint8", (1, 254), (1.5777, 0.99586, 1.008), options=MALE),
    Known("engine/engine.nii.gz", (256, 256, 128), "uint8", (0, 255), unit="mm", space=RAS),
    Known("lung/3DCT_lung.mha", (115, 157, 129), "int16", (-1255, 1474), (1.366, 1.366, 2.5), "mm", LPS),
    Known("phantom", (512, 512, 28), "int16", (-1024, 782), (0.451171875, 0.451171875, 5), "mm", LPS),
    Known(
        "brain/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz",
        (197, 233, 189),
        "uint8",
        (0, 255),
        unit="mm",
        space=RAS,
    ),
    Known("flair/FLAIR.nrrd", (124, 160, 140), "uint8", (0, 255), space=LPS),
    # Stored as 0..255, with a slope of 0.362956.
    Known("orientation/AIL.nii.gz", (79, 67, 64), "float32", (0, 92.55389), (2.38975, 2.36649, 2.38523), "mm", RAS),
    Known("tooth/tooth.nhdr", (103, 94, 161), "uint16", (0, 1300)),
    Known("fly/fly_150x256x256.tif", (256, 256, 150), "uint8", (0, 249)),
    Known("shell/shell_225x128x128.tif", (128, 128, 225), "uint8", (0, 255), unit="µm"),
    Known("hydrogen/hydrogen.vti", (64, 64, 64), "float32", (0, 1)),
    Known("frog/frog_tissues.vti", (500, 470, 136), "uint8", (0, 29), (1, 1, 1.5)),
    Known(
        "nucleus/xyzc_16bit__dna_conf_wf.tif",
        (133, 130, 45),
        "uint16",
        (0, 61711),
        NUCLEUS,
        "µm",
        options={"channel": 0},
    ),
    Known("nucleus/dna_conf_wf.ome.tif", (133, 130, 45), "uint16", (0, 61711), NUCLEUS, "µm", options={"channel": 0}),
    # 25 x 43 x 73 (z, y, x) as stored; columns run along z, rows along x, sections along y.
    Known("protein/EMD-3001.map", (43, 25, 73), "float32", (-0.368143, 0.721610), (0.44825, 0.3925, 0.45875), "Å"),
    Known("protein/emd_3001.map.gz", (43, 25, 73), "float32", (-0.368143, 0.721610), (0.44825, 0.3925, 0.45875), "Å"),
]


@pytest.mark.parametrize("known", KNOWN, ids=lambda known: known.file)
def test_a_real_volume_is_what_its_source_says(known: Known) -> None:
    volume = load(real_volume(known.file), **known.options)
    assert volume.dimensions == known.dimensions
    assert volume.values.dtype == np.dtype(known.dtype)
    assert (volume.unit, volume.space) == (known.unit, known.space)
    # The digits above: six.
    np.testing.assert_allclose(volume.finite_range, known.value_range, rtol=1e-5)
    np.testing.assert_allclose(volume.spacing, known.spacing, rtol=1e-5)


def world(volume: Volume, *index: int) -> np.ndarray:
    return volume.origin + volume.world_from_index @ np.array(index)


def test_an_oblique_direction_is_kept() -> None:
    volume = load(real_volume("flair/FLAIR.nrrd"))
    np.testing.assert_allclose(volume.direction[:, 0], (-0.993592, 0.049705, -0.101510), atol=1e-6)
    np.testing.assert_allclose(volume.origin, (64.898239, 110.431144, -27.925539), atol=1e-6)


def test_voxel_order_ail_becomes_world_ras() -> None:
    """The head's axes run to the front, the bottom and the left: forwards is +y, down is -z, left is -x."""
    volume = load(real_volume("orientation/AIL.nii.gz"))
    wanted = [(0, 0, -1), (1, 0, 0), (0, -1, 0)]
    np.testing.assert_allclose(volume.direction, wanted, atol=1e-6)


def test_both_channels_are_different_and_both_files_are_the_same() -> None:
    first, second = (load(real_volume("nucleus/dna_conf_wf.ome.tif"), channel=channel) for channel in (0, 1))
    assert second.finite_range == (608, 7480)
    assert not np.array_equal(first.values, second.values)
    imagej = load(real_volume("nucleus/xyzc_16bit__dna_conf_wf.tif"), channel=1)
    np.testing.assert_array_equal(imagej.values, second.values)


def test_a_slanted_cell_and_its_start() -> None:
    volume = load(real_volume("protein/EMD-3001.map"))
    assert float(volume.direction[:, 0] @ volume.direction[:, 2]) == pytest.approx(np.cos(np.radians(94.326)), abs=1e-6)
    np.testing.assert_allclose(volume.origin, (-21 * 0.44825, -12 * 0.3925, 0), atol=1e-5)


RIGHT = ["", "_bz2", "_gz", "_gz_byteskip_minus_one", "_gz_lineskip"]


@pytest.mark.parametrize(
    "file",
    [
        *(f"BallBinary30x30x30{name}.nrrd" for name in RIGHT),
        "BallBinary30x30x30.nhdr",
        "BallBinary30x30x30_byteskip_minus_one.nhdr",
        "BallBinary30x30x30_byteskip_minus_one_nifti.nhdr",
        "BallBinary30x30x30.nii.gz",
    ],
)
def test_one_volume_in_several_encodings(file: str) -> None:
    volume = load(real_volume(f"nrrd-encodings/{file}"))
    assert volume.dimensions == (30, 30, 30)
    assert volume.values.dtype == np.int16
    assert volume.values.sum() == 3682296


@pytest.mark.parametrize(
    ("file", "reason"),
    [
        ("nrrd-encodings/BallBinary30x30x30_byteskip_minus_five.nhdr", "byte skip must be at least -1, got -5"),
        ("nrrd-encodings/BallBinary30x30x30_nifti.nhdr", "more than 54000 bytes"),
        ("nrrd-encodings/test1d_ascii.nrrd", "must have 3 axes, got 1"),
        ("nrrd-encodings/test2d_ascii.nrrd", r"must have 3 axes, got 2 \(3 x 9\)"),
        ("nrrd-encodings/BallBinary30x30x30.raw", "--shape NX,NY,NZ"),
    ],
)
def test_what_is_no_volume_is_refused_by_name(file: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        load(real_volume(file))
