"""Formats of the sky, the earth and films: FITS, SEG-Y and OpenVDB, as their own libraries write them."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import segyio
from astropy.io import fits
from astropy.wcs import WCS
from support import marked
from support.missing_library import check_asked_for

from texvol import InputError, MissingExtraError, load
from texvol.formats.readers import openvdb


def sky(**more: Any) -> fits.Header:
    """A header of an oblique linear grid, whose reference lies between pixels."""
    header = fits.Header()
    for axis, (pixel, world) in enumerate(zip((2.0, 1.5, 3.0), marked.ORIGIN, strict=True), 1):
        header[f"CTYPE{axis}"], header[f"CUNIT{axis}"] = "LINEAR", "mm"
        header[f"CRPIX{axis}"], header[f"CRVAL{axis}"] = pixel, world
    for row, column in np.ndindex(3, 3):
        header[f"CD{row + 1}_{column + 1}"] = (marked.DIRECTION * marked.SPACING)[row, column]
    for key, value in more.items():
        header[key] = value
    return header


@pytest.mark.parametrize("name", ["v.fits", "v.fits.gz"])
@pytest.mark.parametrize("dtype", ["u1", "i2", "u2", "i4", "f4", "f8"])
def test_fits_lies_where_astropy_says(tmp_path: Path, name: str, dtype: str) -> None:
    fits.PrimaryHDU(marked.marked(dtype), sky(BUNIT="Jy")).writeto(tmp_path / name)
    volume = load(tmp_path / name)
    position = WCS(fits.getheader(tmp_path / name)).wcs_pix2world([marked.MARK], 0)[0]
    marked.check(volume, dtype, position=position, atol=1e-6)
    assert (volume.unit, volume.value_unit, volume.space) == ("mm", "Jy", "LINEAR (mm), LINEAR (mm), LINEAR (mm)")


def test_steps_with_a_turned_matrix(tmp_path: Path) -> None:
    header = fits.Header(
        {"CDELT1": 2.0, "CDELT2": 3.0, "CDELT3": 4.0, "PC1_1": 0.8, "PC1_2": -0.6, "PC2_1": 0.6, "PC2_2": 0.8}
    )
    fits.PrimaryHDU(marked.marked(), header).writeto(tmp_path / "v.fits")
    position = WCS(fits.getheader(tmp_path / "v.fits")).wcs_pix2world([marked.MARK], 0)[0]
    marked.check(load(tmp_path / "v.fits"), position=position)


def test_a_sky_that_is_turned_in_the_old_way(tmp_path: Path) -> None:
    """CROTA turns what CDELT has scaled; of axes that are no longitude and latitude it says nothing."""
    numbers = {"CDELT1": -2e-4, "CDELT2": 3e-4, "CDELT3": 4.0, "CROTA2": 30.0, "CRVAL1": 180.0, "CRPIX1": 2.0}
    for names in ({"CTYPE1": "RA---CAR", "CTYPE2": "DEC--CAR"}, {"CTYPE1": "X", "CTYPE2": "Y"}):
        fits.PrimaryHDU(marked.marked(), fits.Header(names | numbers)).writeto(tmp_path / "v.fits", overwrite=True)
        position = WCS(fits.getheader(tmp_path / "v.fits")).wcs_pix2world([marked.MARK], 0)[0]
        marked.check(load(tmp_path / "v.fits"), position=position, atol=1e-6)


def test_an_axis_of_one_sample_between_those_of_space(tmp_path: Path) -> None:
    """As radio telescopes' programs write: RA, DEC, STOKES, FREQ."""
    names = {"CTYPE1": "RA---SIN", "CTYPE2": "DEC--SIN", "CTYPE3": "STOKES", "CTYPE4": "FREQ", "CDELT4": 5.0}
    fits.PrimaryHDU(marked.marked()[:, np.newaxis], fits.Header(names)).writeto(tmp_path / "v.fits")
    volume = load(tmp_path / "v.fits")
    np.testing.assert_array_equal(volume.values, marked.marked())
    assert volume.spacing.tolist() == [1, 1, 5]


def test_a_cube_of_the_sky(tmp_path: Path) -> None:
    """With Stokes' parameters as a fourth axis; units differ, and the projection is told of."""
    names = {"CTYPE1": "RA---TAN", "CTYPE2": "DEC--TAN", "CTYPE3": "VRAD", "CTYPE4": "STOKES"}
    units = {"CUNIT1": "deg", "CUNIT2": "deg", "CUNIT3": "m/s"}
    header = fits.Header(names | units | {"CDELT1": -0.1, "CDELT2": 0.1, "CDELT3": 500.0, "CRPIX1": 1.0})
    cube = np.stack([marked.marked(), marked.marked() * 0])
    fits.PrimaryHDU(cube, header).writeto(tmp_path / "v.fits")
    volume = load(tmp_path / "v.fits", channel=0)
    np.testing.assert_array_equal(volume.values, marked.marked())
    np.testing.assert_allclose(np.diag(volume.world_from_index), [-0.1, 0.1, 500])
    assert volume.unit == "" and volume.space == "RA---TAN (deg), DEC--TAN (deg), VRAD (m/s)"
    assert any("different units (deg, deg, m/s)" in note for note in volume.notes)
    assert any("projection of RA---TAN, DEC--TAN is not applied" in note for note in volume.notes)
    with pytest.raises(InputError, match=r"--channel 0\.\.1"):
        load(tmp_path / "v.fits")


def test_images_in_extensions_and_packed_ones(tmp_path: Path) -> None:
    units = [
        fits.PrimaryHDU(),
        fits.ImageHDU(marked.marked() * 0, name="ERR"),
        fits.CompImageHDU(marked.marked(), name="SCI"),
    ]
    fits.HDUList(units).writeto(tmp_path / "v.fits.fz")
    assert load(tmp_path / "v.fits.fz").values.max() == 0
    volume = load(tmp_path / "v.fits.fz", variable="sci")
    np.testing.assert_array_equal(volume.values, marked.marked())
    assert "image SCI" in volume.notes
    with pytest.raises(InputError, match=r"has no image DQ \(--variable\); it has ERR, SCI"):
        load(f"{tmp_path}/v.fits.fz::DQ")


def test_blank_and_scaled_values(tmp_path: Path) -> None:
    header = sky(BLANK=marked.MARK_VALUE)
    fits.PrimaryHDU(marked.marked(), header).writeto(tmp_path / "v.fits")
    assert np.isnan(load(tmp_path / "v.fits").values[marked.MARK[::-1]])
    scaled = fits.PrimaryHDU(marked.marked("i2"))
    scaled.header["BSCALE"], scaled.header["BZERO"], scaled.header["BLANK"] = 0.5, 3, marked.MARK_VALUE
    scaled.writeto(tmp_path / "s.fits")
    values = load(tmp_path / "s.fits").values
    assert np.isnan(values[marked.MARK[::-1]]) and values[0, 0, 1] == 3.5


def test_a_fits_that_makes_no_sense(tmp_path: Path) -> None:
    fits.PrimaryHDU(marked.marked(), sky()).writeto(tmp_path / "v.fits")
    sound = (tmp_path / "v.fits").read_bytes()

    def card(key: str, value: str) -> bytes:
        return f"{key:8}= {value:>20}".encode()

    for old, new, reason in (
        (card("NAXIS1", "5"), card("NAXIS1", "50000"), "samples need"),
        (card("NAXIS1", "5"), card("NAXIS1", "5000000000"), "this machine has|samples need"),
        (card("NAXIS1", "5"), card("NAXIS1", "-5"), "."),
        (card("CD1_1", "1.7320508075688774"), card("CD1_1", "'text'"), "CD1_1 must be a finite number"),
        (card("BITPIX", "16"), card("BITPIX", "17"), "."),
    ):
        assert old in sound
        (tmp_path / "v.fits").write_bytes(sound.replace(old, new))
        with pytest.raises(InputError, match=rf"v\.fits: .*({reason})"):
            load(tmp_path / "v.fits")
    (tmp_path / "v.fits").write_bytes(sound[:2000])
    with pytest.raises(InputError, match=r"v\.fits: "):
        load(tmp_path / "v.fits")


def written_segy(
    path: Path,
    *,
    sorting: int = 2,
    format: int = 1,
    located: bool = True,
    endian: str = "big",
    lines: tuple[int, ...] = (1, 2, 3, 4),
    missing: tuple[tuple[int, int], ...] = (),
) -> Path:
    spec = segyio.spec()
    spec.endian = endian
    spec.sorting, spec.format, spec.samples = sorting, format, np.arange(3) * 4.0 + 100
    spec.ilines, spec.xlines = np.arange(4) + 1, np.arange(5) + 10
    if missing:
        spec.ilines, spec.xlines, spec.tracecount = None, None, 20 - len(missing)
    order = (
        [(i, x) for i in range(4) for x in range(5)] if sorting == 2 else [(i, x) for x in range(5) for i in range(4)]
    )
    with segyio.create(str(path), spec) as file:
        for number, (inline, crossline) in enumerate(each for each in order if each not in missing):
            x, y = np.array([1000, 2000]) + crossline * np.array([20, 10]) + inline * np.array([-15, 30])
            header = {segyio.su.iline: lines[inline], segyio.su.xline: crossline + 10, 109: 100}
            file.header[number] = header | ({181: int(x * 10), 185: int(y * 10), 71: -10} if located else {})
            file.trace[number] = marked.marked("f4")[:, inline, crossline]
        file.bin.update(hdt=4000, hns=3)
    return path


@pytest.mark.parametrize("sorting", [1, 2])
@pytest.mark.parametrize("format", [1, 5])  # IBM's and IEEE's floats
def test_segy_lies_at_the_coordinates_of_its_traces(tmp_path: Path, sorting: int, format: int) -> None:
    volume = load(written_segy(tmp_path / "v.sgy", sorting=sorting, format=format))
    wanted = np.array([1000, 2000]) + 3 * np.array([20, 10]) + 1 * np.array([-15, 30])
    # What comes later lies deeper.
    marked.check(volume, "float32", position=[*wanted, -(100 + 2 * 4)], atol=1e-6)
    assert volume.space == "x (m), y (m), -time (ms)"
    plain = load(written_segy(tmp_path / "w.sgy", located=False))
    assert plain.spacing.tolist() == [1, 1, 4] and any("no coordinates" in note for note in plain.notes)


@pytest.mark.parametrize("sorting", [1, 2])
def test_places_of_segy_without_a_trace_are_nan(tmp_path: Path, sorting: int) -> None:
    # What is left is 12 traces, as many as 3 inlines of 4 crosslines would have.
    missing = ((0, 0), (0, 1), (1, 0), (3, 4), (3, 3), (2, 4), (1, 2), (2, 2))
    volume = load(written_segy(tmp_path / "v.sgy", sorting=sorting, missing=missing))
    wanted = marked.marked("f4").copy()
    for inline, crossline in missing:
        wanted[:, inline, crossline] = np.nan
    np.testing.assert_array_equal(volume.values, wanted)
    np.testing.assert_allclose(volume.origin, [1000, 2000, -100], atol=1e-6)
    assert any("8 of 5 x 4 places have no trace" in note for note in volume.notes)


def test_inlines_of_segy_that_are_missing_leave_a_gap(tmp_path: Path) -> None:
    volume = load(written_segy(tmp_path / "v.sgy", lines=(10, 12, 14, 20), located=False))
    assert volume.values.shape == (3, 6, 5) and np.isnan(volume.values[:, 3:5]).all()
    np.testing.assert_array_equal(volume.values[:, [0, 1, 2, 5]], marked.marked("f4"))


@pytest.mark.parametrize(
    ("lines", "reason"),
    [((1, 2, 3, 3), "several at inline 3, crossline 10"), ((1, 2, 3, 3000), "too few for a grid of 5 x 3000")],
)
def test_traces_of_segy_that_are_on_no_grid(tmp_path: Path, lines: tuple[int, ...], reason: str) -> None:
    with pytest.raises(InputError, match=rf"v\.sgy: .*{reason}"):
        load(written_segy(tmp_path / "v.sgy", lines=lines))


def test_segy_of_the_other_byte_order(tmp_path: Path) -> None:
    volume = load(written_segy(tmp_path / "v.sgy", format=5, endian="little"))
    assert load(written_segy(tmp_path / "w.sgy", format=5)).origin.tolist() == volume.origin.tolist()
    np.testing.assert_array_equal(volume.values, marked.marked())


def test_a_segy_that_makes_no_sense(tmp_path: Path) -> None:
    sound = written_segy(tmp_path / "v.sgy").read_bytes()
    for content in (sound[:5000], sound[:3220] + b"\xff\xff" + sound[3222:], bytes(len(sound)), b"x" * 10_000):
        (tmp_path / "v.sgy").write_bytes(content)
        with pytest.raises(InputError, match=r"v\.sgy: "):
            load(tmp_path / "v.sgy")


VDB = """
import sys, numpy as np, pyopenvdb as vdb
grids = []
for name in sys.argv[2:]:
    values = np.arange(60, dtype="f4").reshape(3, 4, 5).T.copy() + 1
    values[3, 1, 2] = 100
    grid = vdb.FloatGrid(background=-1.5)
    grid.name = name
    grid.copyFromArray(values, ijk=(-2, 5, 7))
    grid.transform = vdb.createLinearTransform([[0, 2, 0, 0], [-3, 0, 0, 0], [0, 0, 4, 0], [10, -20, 30.5, 1]])
    grids.append(grid)
vdb.write(sys.argv[1], grids=grids)
"""
HAS_VDB = (
    subprocess.run(["/usr/bin/python3", "-c", "import pyopenvdb"], capture_output=True, check=False).returncode == 0
)


def written_vdb(path: Path, *names: str) -> Path:
    subprocess.run(["/usr/bin/python3", "-c", VDB, str(path), *names], check=True)
    return path


@pytest.mark.skipif(not HAS_VDB, reason="the system has no python3-openvdb")
def test_openvdb(tmp_path: Path) -> None:
    path = written_vdb(tmp_path / "v.vdb", "density")
    volume = load(path)
    wanted = np.arange(60, dtype="f4").reshape(3, 4, 5) + 1
    wanted[2, 1, 3] = 100
    np.testing.assert_array_equal(volume.values, wanted)
    matrix = np.array([[0, -3, 0], [2, 0, 0], [0, 0, 4.0]])
    np.testing.assert_allclose(marked.found_mark(volume), matrix @ [-2 + 3, 5 + 1, 7 + 2] + [10, -20, 30.5])
    assert "grid density: voxels that are not active are -1.5" in volume.notes
    several = written_vdb(tmp_path / "w.vdb", "density", "heat")
    with pytest.raises(InputError, match="has 2 grids: density, heat; --variable NAME chooses one"):
        load(several)
    assert load(f"{several}::heat").values.max() == 100
    same = written_vdb(tmp_path / "x.vdb", "heat", "heat")
    with pytest.raises(InputError, match=r"has 2 grids: heat\[0\], heat\[1\]; --variable NAME chooses one"):
        load(same)
    assert load(same, variable="heat[1]").values.max() == 100
    assert b"AffineMap" in path.read_bytes()
    (tmp_path / "y.vdb").write_bytes(path.read_bytes().replace(b"AffineMap", b"OblateMap"))
    with pytest.raises(InputError, match=r"y\.vdb: it is damaged, or not as its library expects \("):
        load(tmp_path / "y.vdb")


def test_a_truncated_openvdb_is_told_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenVDB goes round and round in what is cut off; the header says where each grid ends."""
    whole = written_vdb(tmp_path / "v.vdb", "heat", "heat").read_bytes()
    monkeypatch.setattr(openvdb, "_asked", lambda *_: pytest.fail("the library was asked"))
    for length, reason in ((60, "ends at byte 60, within its header"), (len(whole) - 4, "grid heat ends at byte")):
        (tmp_path / "t.vdb").write_bytes(whole[:length])
        with pytest.raises(InputError, match=rf"t\.vdb: is truncated: (it )?{reason}"):
            load(tmp_path / "t.vdb", variable="heat[1]")


def test_openvdb_without_the_systems_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(openvdb, "_PYTHONS", ("/no/python",))
    (tmp_path / "v.vdb").write_bytes(b" BDV\0\0\0\0" + bytes(99))
    with pytest.raises(MissingExtraError, match=r"v\.vdb: reading OpenVDB needs .*: apt install python3-openvdb"):
        load(tmp_path / "v.vdb")


def test_a_missing_library_of_segy_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_asked_for(monkeypatch, written_segy(tmp_path / "v.sgy"), "segyio", "seismic")
