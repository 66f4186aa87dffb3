"""Time series: how many steps there are, each of them, when they were, and what is kept between them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK
import tifffile
from support import marked
from support.dicom_files import slice_of
from support.grid_files import LATITUDES, LEVELS, LONGITUDES, points_of_axes, structured, warped, write_netcdf, written

from texvol import InputError, load
from texvol.formats.readers import TimeSeries, time_steps

STEPS = 4
# Step t is the marked volume plus 10 t, so that which step it is shows in every sample.
VALUES = np.stack([marked.marked() + 10 * step for step in range(STEPS)])


def write_nifti(path: Path) -> None:
    image = nibabel.Nifti1Image(VALUES.T, np.eye(4))
    image.header.set_xyzt_units("mm", "msec")
    image.header["pixdim"][4] = 250
    image.header["toffset"] = 100
    nibabel.save(image, path)


def write_nrrd(path: Path) -> None:
    header: dict[str, Any] = {"encoding": "gzip" if "gz" in path.name else "ascii" if "ascii" in path.name else "raw"}
    header |= {"kinds": ["domain"] * 3 + ["time"], "spacings": [1, 1, 1, 0.5], "units": ["mm", "mm", "mm", "s"]}
    nrrd.write(str(path), VALUES.T, header)


def write_metaimage(path: Path) -> None:
    image = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(each) for each in VALUES])
    SimpleITK.WriteImage(image, str(path), useCompression="z" in path.name)


def write_npy(path: Path) -> None:
    np.save(path, VALUES)


def write_ome(path: Path) -> None:
    metadata = {"axes": "TZYX", "TimeIncrement": 0.25, "TimeIncrementUnit": "s"}
    tifffile.imwrite(path, VALUES, ome=True, photometric="minisblack", metadata=metadata)


def write_imagej(path: Path) -> None:
    metadata = {"axes": "TZYX", "finterval": 0.25}
    tifffile.imwrite(path, VALUES, imagej=True, photometric="minisblack", metadata=metadata)


def write_classic(path: Path) -> None:
    write_netcdf(path, VALUES, AXES, form="NETCDF3_CLASSIC")


def write_netcdf4(path: Path) -> None:
    write_netcdf(path, VALUES, AXES)


def write_dicom(path: Path) -> None:
    path.mkdir()
    for step in range(STEPS):
        for number in range(3):
            one = slice_of(number)
            one.InstanceNumber = 10 * step + number
            one.PixelData = VALUES[step, number].astype(one.pixel_array.dtype).tobytes()
            one.SOPInstanceUID += f".{step}"
            one.save_as(path / f"{step}-{number}.dcm", enforce_file_format=True)


AXES = [("time", 6.0 * np.arange(STEPS), "hours since 2001-01-01")]
AXES += [(name, np.arange(size * 1.0), "m") for name, size in zip("zyx", marked.DIMENSIONS[::-1], strict=True)]
WRITERS: dict[str, tuple[Callable[[Path], None], list[float] | None, str]] = {
    "v.nii": (write_nifti, [100, 350, 600, 850], "ms"),
    "v.nii.gz": (write_nifti, [100, 350, 600, 850], "ms"),
    "v.nrrd": (write_nrrd, [0, 0.5, 1, 1.5], "s"),
    "gz.nrrd": (write_nrrd, [0, 0.5, 1, 1.5], "s"),
    "ascii.nrrd": (write_nrrd, [0, 0.5, 1, 1.5], "s"),
    "v.mha": (write_metaimage, None, ""),
    "z.mha": (write_metaimage, None, ""),
    "v.npy": (write_npy, None, ""),
    "v.ome.tif": (write_ome, [0, 0.25, 0.5, 0.75], "s"),
    "v.tif": (write_imagej, [0, 0.25, 0.5, 0.75], "s"),
    "v.nc": (write_netcdf4, [0, 6, 12, 18], "hours since 2001-01-01"),
    "classic.nc": (write_classic, [0, 6, 12, 18], "hours since 2001-01-01"),
}
ALL = pytest.mark.parametrize("name", WRITERS)


@ALL
def test_every_step_is_the_one_that_load_reads(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    write, times, unit = WRITERS[name]
    write(path)
    assert time_steps(path) == STEPS
    with TimeSeries(path) as series:
        assert len(series) == STEPS
        for step in (2, 0, 3, 1, 3):  # in any order, and again
            volume = series[step]
            np.testing.assert_array_equal(volume.values, VALUES[step])
            alone = load(path, time=step)
            np.testing.assert_array_equal(alone.values, VALUES[step])
            assert (volume.source, volume.name, volume.unit) == (alone.source, alone.name, alone.unit)
            np.testing.assert_array_equal(volume.world_from_index, alone.world_from_index)
            np.testing.assert_array_equal(volume.origin, alone.origin)
        assert (None if series.times is None else series.times.tolist()) == times
        assert series.time_unit == unit
        assert series.finite_range == (0, 130)
        np.testing.assert_array_equal(series[-1].values, VALUES[-1])
        assert [int(volume.values.max()) for volume in series] == [100, 110, 120, 130]
        assert [int(volume.values.max()) for volume in series[1:3]] == [110, 120]


@ALL
def test_a_step_that_is_not_there_is_refused_with_their_number(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name][0](path)
    with TimeSeries(path) as series:
        for step in (STEPS, -STEPS - 1, 10**9):
            with pytest.raises(InputError, match=rf"^{path}: time step {step} does not exist: it has 4 steps, from 0$"):
                series[step]
    for step in (STEPS, 10**9):
        with pytest.raises(InputError, match=rf"^{path}: --time must be in 0\.\.3, got {step}: it has 4 time steps$"):
            load(path, time=step)


@pytest.mark.parametrize("name", ["v.nii", "v.nrrd", "v.npy", "v.nc", "v.mha", "v.raw"])
def test_a_file_without_time_has_one_step(tmp_path: Path, name: str) -> None:
    path, values = tmp_path / name, VALUES[0]
    options: dict[str, Any] = {}
    if name == "v.nii":
        nibabel.save(nibabel.Nifti1Image(values.T, np.eye(4)), path)
    elif name == "v.nrrd":
        nrrd.write(str(path), values.T)
    elif name == "v.npy":
        np.save(path, values)
    elif name == "v.nc":
        write_netcdf(path, values, AXES[1:])
    elif name == "v.mha":
        SimpleITK.WriteImage(SimpleITK.GetImageFromArray(values), str(path))
    else:
        path.write_bytes(values.tobytes())
        options = {"shape": marked.DIMENSIONS, "dtype": "int16"}
    assert time_steps(path, **options) == 1
    series = TimeSeries(path, **options)
    np.testing.assert_array_equal(series[0].values, values)
    assert (len(series), series.times, series.finite_range) == (1, None, (0, 100))
    with pytest.raises(InputError, match="time step 1 does not exist: it has 1 step, from 0"):
        series[1]


def test_slices_at_the_same_places_are_steps(tmp_path: Path) -> None:
    write_dicom(tmp_path / "series")
    series = TimeSeries(tmp_path / "series")
    assert len(series) == time_steps(tmp_path / "series") == STEPS
    np.testing.assert_array_equal(series[2].values, load(tmp_path / "series", time=2).values)
    assert series[2].values.max() > series[1].values.max()


def test_an_axis_without_a_name_is_time_unless_a_channel_is_chosen(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", VALUES)
    assert time_steps(tmp_path / "v.npy") == STEPS
    assert time_steps(tmp_path / "v.npy", channel=1) == 1
    np.testing.assert_array_equal(TimeSeries(tmp_path / "v.npy", channel=1)[0].values, VALUES[1])
    np.save(tmp_path / "w.npy", VALUES[np.newaxis].repeat(2, axis=0))
    with pytest.raises(InputError, match="2 axes that could be time"):
        time_steps(tmp_path / "w.npy")


def test_steps_of_one_channel(tmp_path: Path) -> None:
    both = np.stack([VALUES, -VALUES], axis=2)
    tifffile.imwrite(tmp_path / "v.tif", both, imagej=True, photometric="minisblack", metadata={"axes": "TZCYX"})
    series = TimeSeries(tmp_path / "v.tif", channel=1)
    np.testing.assert_array_equal(series[3].values, -VALUES[3])
    assert series.finite_range == (-130, 0)


def test_a_spacing_holds_for_every_step(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", VALUES)
    for volume in TimeSeries(tmp_path / "v.npy", spacing=(1, 2, 3)):
        np.testing.assert_array_equal(volume.spacing, [1, 2, 3])


def test_what_is_compressed_is_unpacked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from texvol.formats.readers import stored

    write_nifti(tmp_path / "v.nii.gz")
    calls = []
    whole = stored._read_packed
    monkeypatch.setattr(stored, "_read_packed", lambda *arguments: calls.append(1) or whole(*arguments))
    series = TimeSeries(tmp_path / "v.nii.gz")
    assert [int(volume.values.max()) for volume in series] == [100, 110, 120, 130]
    assert len(calls) == 1
    series.close()
    assert series[1].values.max() == 110
    assert len(calls) == 2


def test_of_what_is_not_compressed_only_the_step_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_nifti(tmp_path / "v.nii")
    counts = []
    whole = np.fromfile
    monkeypatch.setattr(np, "fromfile", lambda file, dtype, count: counts.append(count) or whole(file, dtype, count))
    assert load(tmp_path / "v.nii", time=3).values.max() == 130
    assert counts == [60]


def test_a_step_of_its_own_does_not_hold_the_others(tmp_path: Path) -> None:
    write_nifti(tmp_path / "v.nii.gz")
    values = load(tmp_path / "v.nii.gz", time=1).values
    assert values.base is None or values.base.nbytes == values.nbytes


def test_a_netcdf_file_is_opened_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import netCDF4

    write_netcdf4(tmp_path / "v.nc")
    opened = []
    whole = netCDF4.Dataset
    monkeypatch.setattr(netCDF4, "Dataset", lambda *arguments: opened.append(1) or whole(*arguments))
    with TimeSeries(tmp_path / "v.nc") as series:
        opened.clear()  # to count its steps is one
        assert series.finite_range == (0, 130)
        assert len(opened) == 1


def test_places_in_a_curvilinear_grid_are_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from texvol.formats.readers import cells

    path, points = tmp_path / "v.nc", warped((5, 4, 3))
    axes = [AXES[0], *((name, None, "") for name in ("k", "j", "i"))]
    write_netcdf(path, VALUES, axes, coordinates="lon lat height")
    import netCDF4

    with netCDF4.Dataset(path, "a") as dataset:
        for axis, (name, units) in enumerate((("lon", "degrees_east"), ("lat", "degrees_north"), ("height", "m"))):
            variable = dataset.createVariable(name, "f8", ("k", "j", "i"))
            variable.units = units
            variable[:] = points[..., axis]
    calls = []
    whole = cells.Cells.locate
    monkeypatch.setattr(cells.Cells, "locate", lambda *arguments: calls.append(1) or whole(*arguments))
    alone = [load(path, time=step) for step in range(STEPS)]
    assert len(calls) == STEPS
    with TimeSeries(path) as series:
        for step, volume in enumerate(series):
            np.testing.assert_array_equal(volume.values, alone[step].values)
            assert volume.resampling == alone[step].resampling
    assert len(calls) == STEPS + 1


def test_a_series_has_all_steps(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", VALUES)
    with pytest.raises(InputError, match="time must be None for a series, got 2"):
        TimeSeries(tmp_path / "v.npy", time=2)
    with pytest.raises(TypeError, match="colour"):
        TimeSeries(tmp_path / "v.npy", colour=2)


def test_a_file_that_is_none_is_refused_as_load_does(tmp_path: Path) -> None:
    (tmp_path / "v.nrrd").write_bytes(b"NRRD0004\n")
    for use in (time_steps, TimeSeries, load):
        with pytest.raises(InputError, match=r"v\.nrrd: its header has no field"):
            use(tmp_path / "v.nrrd")


def test_vtk_files_have_one_step(tmp_path: Path) -> None:
    points = points_of_axes([LONGITUDES, LATITUDES, LEVELS])
    assert time_steps(written(tmp_path / "v.vts", structured(points, VALUES[0]))) == 1


def test_steps_without_a_finite_value_have_no_range(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.full((2, 3, 4, 5), np.nan))
    assert TimeSeries(tmp_path / "v.npy").finite_range is None
    values = np.full((2, 3, 4, 5), np.nan)
    values[1, 0, 0, :2] = -3, 8
    values[0, 0, 0, 0] = np.inf
    np.save(tmp_path / "w.npy", values)
    assert TimeSeries(tmp_path / "w.npy").finite_range == (-3, 8)
