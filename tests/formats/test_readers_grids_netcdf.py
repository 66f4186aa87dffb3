"""netCDF: which variable, what its dimensions mean, where its samples lie, and what of it is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from support import marked
from support.grid_files import LATITUDES, LEVELS, LONGITUDES, linear, points_of, points_of_axes, write_netcdf
from support.real_data import real_volume
from support.refusal import refused

from texvol import InputError, load
from texvol.cli import information
from texvol.util.installation import install_command

FORMS = ["NETCDF4", "NETCDF4_CLASSIC", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA"]
Z, Y, X = 30.5 - 4 * np.arange(3.0), -20 + 3 * np.arange(4.0), 10 + 2 * np.arange(5.0)
EVEN = [("z", Z, "m"), ("y", Y, "m"), ("x", X, "m")]
POSITION = np.array(marked.ORIGIN) + np.array([2, 3, -4]) * marked.MARK
UNEVEN = (LONGITUDES, LATITUDES, LEVELS)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_the_format(tmp_path: Path, form: str) -> None:
    volume = load(write_netcdf(tmp_path / "v.nc", marked.marked(), EVEN, form=form))
    marked.check(volume, position=POSITION)
    assert (volume.unit, volume.space) == ("m", "x (m), y (m), z (m)")
    assert volume.resampling is None


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "f4", "f8", "u1", "u2", "u4", "i8"])
def test_every_type(tmp_path: Path, dtype: str) -> None:
    marked.check(load(write_netcdf(tmp_path / "v.nc", marked.marked(dtype), EVEN)), dtype, position=POSITION)


def test_levels_and_latitudes_that_decrease_stay_in_the_files_order(tmp_path: Path) -> None:
    path = write_netcdf(tmp_path / "v.nc", linear(points_of_axes(UNEVEN)))
    volume = load(path)
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), rtol=1e-12)
    np.testing.assert_allclose(points_of(volume)[0, 0, 0], [10, 40, 1000])
    np.testing.assert_allclose(points_of(volume)[-1, -1, -1], [18, 31, 500])
    np.testing.assert_array_equal(np.diag(volume.direction), [1, -1, -1])
    assert volume.unit == ""
    assert volume.space == "lon (degrees_east), lat (degrees_north), lev (hPa)"
    assert "different units (degrees_east, degrees_north, hPa)" in information.text(information.metadata(volume))


def test_axes_in_several_units_of_length_have_that_of_x(tmp_path: Path) -> None:
    axes = [("z", Z * 1000, "meters"), ("y", Y, "km"), ("x", X, "kilometers")]
    volume = load(write_netcdf(tmp_path / "v.nc", marked.marked(), axes))
    marked.check(volume, position=POSITION)
    assert (volume.unit, volume.space) == ("km", "x (km), y (km), z (m)")


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_axes_that_say_what_they_are_may_stand_in_any_order(tmp_path: Path, order: tuple) -> None:
    axes = [("lev", LEVELS, "hPa"), ("lat", LATITUDES, "degrees_north"), ("lon", LONGITUDES, "degrees_east")]
    values = linear(points_of_axes(UNEVEN)).transpose(order)
    volume = load(write_netcdf(tmp_path / "v.nc", values, [axes[axis] for axis in order]))
    np.testing.assert_allclose(volume.values, linear(points_of(volume)), rtol=1e-12)
    np.testing.assert_allclose(points_of(volume)[0, 0, 0], [10, 40, 1000])


def test_dimensions_without_coordinates_count_samples(tmp_path: Path) -> None:
    axes = [(name, None, "") for name in ("a", "b", "c")]
    marked.check(load(write_netcdf(tmp_path / "v.nc", marked.marked(), axes)), position=marked.MARK)


def test_packed_values_are_unpacked_and_marked_ones_missing(tmp_path: Path) -> None:
    """By the file's words: scale_factor · stored + add_offset, NaN where _FillValue or outside of valid_range."""
    packing = {"scale_factor": 0.5, "add_offset": 10.0, "_FillValue": np.int16(7), "valid_range": np.int16([0, 50])}
    volume = load(write_netcdf(tmp_path / "v.nc", np.arange(60, dtype="i2").reshape(3, 4, 5), EVEN, **packing))
    wanted = 0.5 * np.arange(60.0).reshape(3, 4, 5) + 10
    wanted[0, 1, 2] = np.nan
    wanted[wanted > 35] = np.nan
    np.testing.assert_array_equal(volume.values, wanted)
    assert volume.values.dtype == np.float32


@pytest.mark.parametrize(("dtype", "made"), [("i2", "f4"), ("i4", "f8"), ("f4", "f4")])
def test_a_missing_value_is_nan(tmp_path: Path, dtype: str, made: str) -> None:
    volume = load(write_netcdf(tmp_path / "v.nc", marked.marked(dtype), EVEN, missing_value=np.array(100, dtype)))
    assert volume.values.dtype == np.dtype(made)
    assert np.isnan(volume.values[marked.MARK[::-1]])
    assert np.isnan(volume.values).sum() == 1


def several(path: Path) -> Path:
    write_netcdf(path, marked.marked(), EVEN, name="first", long_name="the first one", units="K")
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.createVariable("flat", "f4", ("y", "x"))[:] = 0
        dataset.createVariable("second", "f4", ("z", "y", "x"))[:] = 5
        dataset.createVariable("words", str, ("z",))
        group = dataset.createGroup("model")
        group.createVariable("third", "i2", ("z", "y", "x"))[:] = marked.marked()
    return path


def test_the_first_variable_that_is_a_volume_is_read_and_named(tmp_path: Path) -> None:
    volume = load(several(tmp_path / "v.nc"))
    marked.check(volume, position=POSITION)
    note = "variable first (the first one, K), the first of 3: first, second, model/third; --variable NAME chooses"
    assert volume.notes == (note,)
    assert note in information.text(information.metadata(volume))


def test_a_variable_is_chosen_by_name(tmp_path: Path) -> None:
    path = several(tmp_path / "v.nc")
    assert load(path, variable="second").value_range == (5, 5)
    marked.check(load(path, variable="model/third"), position=POSITION)


@pytest.mark.parametrize(
    ("variable", "reason"),
    [
        (
            "fourth",
            "has no variable fourth (--variable); it has z, y, x, first, flat, second, words, model/third",
        ),
        ("flat", "its variable flat must have three axes of space, got dimensions y 4, x 5"),
        ("words", "its variable words must be real numbers, got <class 'str'>"),
    ],
)
def test_a_variable_that_is_no_volume(
    tmp_path: Path, variable: str, reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert reason in refused(several(tmp_path / "v.nc"), capfd, variable=variable)


def test_a_film_of_a_plane_is_no_volume(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    axes = [("time", np.arange(3.0), "days since 2000-01-01"), *EVEN[1:]]
    path = write_netcdf(tmp_path / "v.nc", marked.marked(), axes)
    assert "no variable with three axes of space; it has t (time, y, x)" in refused(path, capfd)


def test_members_of_an_ensemble_are_channels(tmp_path: Path) -> None:
    values = np.stack([marked.marked() * 0, marked.marked()])
    path = write_netcdf(tmp_path / "v.nc", values, [("member", None, ""), *EVEN])
    marked.check(load(path, channel=1), position=POSITION)
    with pytest.raises(InputError, match=r"choose one with --channel 0\.\.1"):
        load(path)


@pytest.mark.parametrize(
    ("axis", "reason"),
    [
        ([1, 2, 2, 3, 4], "axis x repeats a coordinate: samples 1 and 2 are at 2"),
        ([1, 2, 4, 3, 5], r"axis x is not monotonic: samples 1\.\.3 are at 2, 4, 3"),
        ([1, 2, np.nan, 3, 5], "coordinate 2 of its axis x must be finite, got nan"),
        ([1, 2, np.inf, 3, 5], "coordinate 2 of its axis x must be finite, got inf"),
        ([-1e308, 0, 1, 2, 1e308], "must be at most 1e150"),
    ],
)
def test_axes_that_make_no_grid(tmp_path: Path, axis: list, reason: str) -> None:
    path = write_netcdf(tmp_path / "v.nc", marked.marked(), [*EVEN[:2], ("x", np.array(axis), "m")])
    with pytest.raises(InputError, match=rf"^{path}: .*{reason}"):
        load(path)


def curvilinear(path: Path, two_way: bool = False) -> tuple[Path, np.ndarray]:
    """A rotated grid of longitudes and latitudes on even levels; or, with heights of all samples, on uneven ones."""
    j, i = np.mgrid[0:6.0, 0:7.0]
    longitudes, latitudes = 10 + 0.8 * i + 0.3 * j + 0.02 * i * j, 40 - 0.2 * i + 0.9 * j
    heights = np.arange(4.0)[:, None, None] * (100 + 3 * i * j)
    points = np.empty((4, 6, 7, 3))
    points[..., 0], points[..., 1] = longitudes, latitudes
    points[..., 2] = heights if two_way else 100 * np.arange(4.0)[:, None, None]
    with netCDF4.Dataset(path, "w") as dataset:
        for name, size in (("lev", 4), ("nj", 6), ("ni", 7)):
            dataset.createDimension(name, size)
        for name, units, values in (("lon", "degrees_east", longitudes), ("lat", "degrees_north", latitudes)):
            variable = dataset.createVariable(name, "f8", ("nj", "ni"))
            variable.units = units
            variable[:] = values
        name, along = ("height", ("lev", "nj", "ni")) if two_way else ("lev", ("lev",))
        variable = dataset.createVariable(name, "f8", along)
        variable.setncatts({"units": "m", "positive": "up"})
        variable[:] = heights if two_way else 100 * np.arange(4.0)
        variable = dataset.createVariable("t", "f8", ("lev", "nj", "ni"))
        variable.coordinates = "lon lat height" if two_way else "lon lat"
        variable[:] = linear(points / [1, 1, 100])
    return path, points


@pytest.mark.parametrize("two_way", [False, True])
def test_coordinates_of_two_or_three_dimensions_make_a_curvilinear_grid(tmp_path: Path, two_way: bool) -> None:
    path, points = curvilinear(tmp_path / "v.nc", two_way)
    volume = load(path)
    assert volume.resampling["grid"] == "curvilinear"
    found = np.isfinite(volume.values)
    assert found.mean() > (0.25 if two_way else 0.4)  # the grid is a rhomb in its box, or a wedge of one
    np.testing.assert_allclose(volume.values[found], linear(points_of(volume) / [1, 1, 100])[found], atol=1e-9)
    np.testing.assert_allclose(volume.origin, points.min(axis=(0, 1, 2)), atol=1e-12)
    assert volume.space == f"lon (degrees_east), lat (degrees_north), {'height' if two_way else 'lev'} (m)"


def unstructured(path: Path, kind: str) -> Path:
    with netCDF4.Dataset(path, "w") as dataset:
        names = {"exodus": "num_nodes num_elem three", "icon": "lev ncells three", "ugrid": "lev nFaces three"}[kind]
        for name in names.split():
            dataset.createDimension(name, 3)
        variable = dataset.createVariable("t", "f4", tuple(names.split()[:2]))
        variable[:] = 0
        if kind == "icon":
            variable.CDI_grid_type = "unstructured"
        if kind == "ugrid":
            variable.setncatts({"mesh": "mesh2d", "location": "face"})
    return path


@pytest.mark.parametrize(("kind", "named"), [("exodus", "an Exodus mesh"), ("icon", "grid"), ("ugrid", "(UGRID)")])
@pytest.mark.parametrize("variable", [None, "t"])
def test_unstructured_grids_are_refused_by_name(
    tmp_path: Path, kind: str, named: str, variable: str | None, capfd: pytest.CaptureFixture[str]
) -> None:
    message = refused(unstructured(tmp_path / "v.nc", kind), capfd, variable=variable)
    assert named in message
    if kind == "exodus":
        assert "is an Exodus mesh: its name must end in .e, .exo, .ex2 or .exii" in message
        return
    assert (
        "which texvol does not read; resample it onto a regular grid, in ParaView by the filter Resample To Image"
        in message
    )


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("v.cgns", "CGNS"),
        ("v.inp", "an Abaqus mesh, which holds no field"),
        ("v.mesh", "a Medit mesh, which holds no field"),
    ],
)
def test_unstructured_formats_are_refused_by_name(
    tmp_path: Path, name: str, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text('<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0">')
    message = refused(tmp_path / name, capfd)
    assert f"is {kind}, which texvol does not read; resample it onto a regular grid, in ParaView" in message


def test_a_header_that_wants_more_than_there_is(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A netCDF-4 file may state dimensions of which it holds no sample."""
    with netCDF4.Dataset(tmp_path / "v.nc", "w") as dataset:
        for name in "zyx":
            dataset.createDimension(name, 10**5)
        dataset.createVariable("t", "f4", tuple("zyx"), chunksizes=(10, 10, 10))
    assert "this machine has" in refused(tmp_path / "v.nc", capfd)


@pytest.mark.parametrize("form", FORMS[2:])
def test_a_classic_file_without_its_last_samples_is_truncated(
    tmp_path: Path, form: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Records too: the library would read zeros."""
    path = write_netcdf(tmp_path / "v.nc", np.ones((2, 3, 4, 5)), form=form)
    content = path.read_bytes()
    path.write_bytes(content[:-100])
    wanted = f"is truncated: its samples end at byte {len(content)} of {len(content) - 100}"
    assert wanted in refused(path, capfd, time=0)


def test_a_heap_that_the_library_never_gets_past_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write_netcdf(tmp_path / "v.nc", marked.marked(), EVEN)
    content = bytearray(path.read_bytes())
    heap = content.find(b"GCOL\x01")
    assert heap > 0
    content[heap + 16 : heap + 32] = bytes(16)  # an object of number 0, the free rest, of size 0
    path.write_bytes(content)
    assert "its heap at byte" in refused(path, capfd)


def test_the_library_is_asked_for_by_name(tmp_path: Path) -> None:
    path = write_netcdf(tmp_path / "v.nc", marked.marked(), EVEN)
    code = (
        "import sys; sys.modules['netCDF4'] = None; from texvol import load, MissingExtraError\n"
        "try: load(sys.argv[1])\n"
        "except MissingExtraError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=True)
    wanted = f"{path}: reading netCDF needs netCDF4, which is not installed: {install_command('formats')}"
    assert done.stdout.strip() == wanted


def test_the_real_atmosphere() -> None:
    """192 longitudes, even; 96 Gaussian latitudes from north to south and 17 pressure levels upwards, uneven."""
    path = real_volume("atmosphere/rectilinear_grid_3D.nc")
    with netCDF4.Dataset(path) as dataset:
        axes = [np.array(dataset[name][:], np.float64) for name in ("lon", "lat", "lev")]
        source = np.array(dataset["rhumidity"][0], np.float64)
    volume = load(path)
    assert volume.notes[0].startswith("variable rhumidity (relative humidity), the first of 3: rhumidity, var3, t;")
    last = volume.origin + volume.world_from_index @ (np.array(volume.dimensions) - 1)
    points = points_of(volume, 5)
    for axis in range(3):
        np.testing.assert_allclose(points[0, 0, 0, axis], axes[axis][0])
        np.testing.assert_allclose(last[axis], axes[axis][-1])
    upwards = [axes[0], axes[1][::-1], axes[2][::-1]]
    theirs = RegularGridInterpolator(upwards[::-1], source[::-1, ::-1])(
        np.clip(points[..., ::-1], *[[axis[end] for axis in upwards[::-1]] for end in (0, -1)])
    )
    np.testing.assert_allclose(
        volume.values[::5, ::5, ::5], theirs, rtol=0, atol=1e-6
    )  # of values up to 1.3 in float32
    assert volume.dimensions[0] == 192
    assert volume.resampling["rms_error_share"] < 0.01
    assert load(path, variable="t").notes[0] == "variable t (temperature, K)"
