"""Volumes from and to other libraries: values, positions in the world, units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import texvol
from texvol.formats.interchange import volume_of
from texvol.scene.volume import Volume
from texvol.util.late import _FUNCTIONS, late

VALUES = np.arange(4 * 3 * 2, dtype=np.int16).reshape(4, 3, 2)
TURN = np.array([[0.0, -1.0, 0.0], [0.8, 0.0, -0.6], [0.6, 0.0, 0.8]])


def oblique(space: str = "right-anterior-superior") -> Volume:
    return Volume(VALUES, (1, 2, 3), (10, -20, 30), TURN, unit="mm", space=space, name="oblique")


def world(volume: Volume, x: int, y: int, z: int) -> np.ndarray:
    return volume.origin + volume.world_from_index @ np.array([x, y, z])


def assert_same_place(found: Volume, wanted: Volume, flip: tuple[int, int, int] = (1, 1, 1)) -> None:
    np.testing.assert_array_equal(found.values, wanted.values)
    for index in ((0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 2, 3)):
        np.testing.assert_allclose(world(found, *index), np.array(flip) * world(wanted, *index), atol=1e-5)


def test_each_late_function_is_there() -> None:
    for name in _FUNCTIONS:
        with pytest.raises(TypeError, match="missing|positional"):
            late(name)


def test_nibabel_and_back() -> None:
    nibabel = pytest.importorskip("nibabel")
    image = oblique().to_nibabel()
    np.testing.assert_allclose(image.affine @ [1, 2, 3, 1], [*world(oblique(), 1, 2, 3), 1], atol=1e-5)
    assert image.get_fdata()[1, 2, 3] == VALUES[3, 2, 1]
    assert image.header.get_xyzt_units()[0] == "mm"
    found = Volume.from_nibabel(nibabel.Nifti1Image.from_bytes(image.to_bytes()))
    assert_same_place(found, oblique())
    assert (found.unit, found.space) == ("mm", "right-anterior-superior")


def test_nibabel_has_the_world_of_a_volume_of_another() -> None:
    pytest.importorskip("nibabel")
    image = oblique("left-posterior-superior").to_nibabel()
    np.testing.assert_allclose(image.affine @ [0, 0, 0, 1], [-10, 20, 30, 1], atol=1e-5)


def test_nibabel_scales() -> None:
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(VALUES.T, np.eye(4))
    image.header.set_slope_inter(0.5, 7)
    found = Volume.from_nibabel(nibabel.Nifti1Image.from_bytes(image.to_bytes()))
    np.testing.assert_allclose(found.values, nibabel.Nifti1Image.from_bytes(image.to_bytes()).get_fdata().T)


def test_nibabel_of_four_axes_is_refused() -> None:
    nibabel = pytest.importorskip("nibabel")
    with pytest.raises(texvol.InputError, match=r"must have 3 axes, got shape \(2, 3, 4, 5\); image.slicer"):
        Volume.from_nibabel(nibabel.Nifti1Image(np.zeros((2, 3, 4, 5), np.float32), np.eye(4)))


def test_simpleitk_and_back(tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = oblique().to_sitk()
    np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((1, 2, 3)), [-1, -1, 1] * world(oblique(), 1, 2, 3))
    assert image[1, 2, 3] == VALUES[3, 2, 1]
    found = Volume.from_sitk(image)
    assert_same_place(found, oblique(), (-1, -1, 1))
    sitk.WriteImage(image, str(tmp_path / "a.nrrd"))
    assert_same_place(texvol.load(tmp_path / "a.nrrd"), found)


def test_simpleitk_of_several_components_is_refused() -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(np.zeros((2, 2, 2, 3), np.float32), isVector=True)
    with pytest.raises(texvol.InputError, match="must have 1 component, got 3"):
        Volume.from_sitk(image)


def test_pyvista_and_back() -> None:
    pytest.importorskip("pyvista")
    image = oblique().to_pyvista()
    number = image.FindPoint(*world(oblique(), 1, 2, 3))
    assert image.active_scalars[number] == VALUES[3, 2, 1]
    assert_same_place(Volume.from_pyvista(image), oblique())


def test_vtk_values_of_cells_lie_in_their_middles() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(3, 4, 5), spacing=(1, 2, 3), origin=(7, 8, 9))
    image.cell_data["density"] = VALUES.ravel()
    found = Volume.from_pyvista(image)
    np.testing.assert_allclose(found.origin, (7.5, 9, 10.5))
    np.testing.assert_array_equal(found.values, VALUES)


def test_pyvista_names_its_arrays() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(2, 3, 4))
    image.point_data["one"], image.point_data["two"] = VALUES.ravel(), VALUES.ravel() + 1
    np.testing.assert_array_equal(Volume.from_pyvista(image, scalars="two").values, VALUES + 1)
    with pytest.raises(texvol.InputError, match=r"scalars must name one of its arrays \(one, two\), got 'three'"):
        Volume.from_pyvista(image, scalars="three")
    with pytest.raises(texvol.InputError, match="must be an ImageData, got vtkPolyData"):
        Volume.from_pyvista(pyvista.Sphere())


def coordinates(**orders: np.ndarray) -> dict:
    return {name: (name, positions, {"units": "um"}) for name, positions in orders.items()}


def test_xarray_is_known_by_names_and_coordinates() -> None:
    xarray = pytest.importorskip("xarray")
    places = coordinates(x=5 + 0.5 * np.arange(2), y=2.0 * np.arange(3), z=9 - 3.0 * np.arange(4))
    array = xarray.DataArray(VALUES.T, places, ("x", "y", "z"), name="cells", attrs={"units": "K"})
    found = Volume.from_xarray(array)
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(world(found, 1, 2, 3), (5.5, 4, 0))
    assert (found.unit, found.value_unit, found.name) == ("µm", "K", "cells")
    back = found.to_xarray()
    np.testing.assert_allclose(back.sel(x=5.5, y=4, z=0), VALUES[3, 2, 1])
    assert back.z.attrs["units"] == "µm"


def test_xarray_of_the_earth() -> None:
    xarray = pytest.importorskip("xarray")
    places = {"lat": 50.0 - np.arange(3), "lon": np.arange(2.0), "level": np.arange(4.0)}
    array = xarray.DataArray(VALUES.transpose(1, 2, 0), places, ("lat", "lon", "level"))
    found = Volume.from_xarray(array)
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(world(found, 1, 2, 3), (1, 48, 3))


def test_xarray_that_is_uneven_or_oblique_is_refused() -> None:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(VALUES, {"z": [0.0, 1.0, 2.0, 9.0]}, ("z", "y", "x"))
    with pytest.raises(texvol.InputError, match="its coordinates z must be even"):
        Volume.from_xarray(array)
    with pytest.raises(texvol.InputError, match="coordinates need axes along x, y, z"):
        oblique().to_xarray()


def placed(*dims: tuple[str, dict], size: int = 2, **scales: float):
    """Return an array with as many samples along each of its dimensions as its place says, and attributes of these."""
    xarray = pytest.importorskip("xarray")
    places = {name: (name, scales.get(name, 1.0) * np.arange(size + n), told) for n, (name, told) in enumerate(dims)}
    return xarray.DataArray(np.random.default_rng(1).random([len(each[1]) for each in places.values()]), places)


@pytest.mark.parametrize(
    "dims",
    [
        (("x", {}), ("y", {}), ("z", {})),
        (("easting", {"axis": "X"}), ("northing", {"axis": "Y"}), ("up", {"axis": "Z"})),
        (("i", {"standard_name": "projection_x_coordinate"}), ("j", {"units": "degrees_N"}), ("k", {"units": "hPa"})),
        (("a", {"units": "degrees_east"}), ("b", {"units": "degrees_north"}), ("h", {"positive": "up"})),
        (("lon", {}), ("lat", {}), ("height", {})), (("width", {}), ("height", {}), ("depth", {})),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:the axes x, y, z have different units")
def test_an_array_of_x_y_z_is_not_transposed(dims: tuple) -> None:
    array = placed(*dims)
    for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0)):
        found = Volume.from_xarray(array.transpose(*(dims[number][0] for number in order)))
        assert found.dimensions == (2, 3, 4)
        np.testing.assert_array_equal(found.values, array.values.T)


@pytest.mark.parametrize(
    ("dims", "words"),
    [
        ("xyq", r"must be named for z, y, x .* got x, y, q; array.rename\(q='z'\)"),
        ("xpq", "must be named .* got x, p, q"), ("zy", "three dimensions .* got z, y;"),
        ("yx", r"must have three dimensions of space, got y, x; isel\(z=\[3\]\)"),
        ("tyx", r"must have three dimensions of space, got t, y, x; array.rename\(t='z'\) makes one of t"),
        ("zyxq", r"must be named .* got z, y, x, q; array.rename\(q='channel'\)"),
    ],
)  # fmt: skip
def test_xarray_whose_axes_are_not_known_is_refused(dims: str, words: str) -> None:
    with pytest.raises(texvol.InputError, match=words):
        Volume.from_xarray(placed(*((name, {}) for name in dims)))
    assert Volume.from_xarray(placed(("p", {}), ("q", {}), ("r", {}))).dimensions == (4, 3, 2), "z, y, x by their order"


def test_a_dataset_is_refused() -> None:
    with pytest.raises(texvol.InputError, match=r"must be a DataArray, got Dataset; .* it has heat"):
        texvol.render(placed(("z", {}), ("y", {}), ("x", {})).to_dataset(name="heat"), 16)


def test_units_of_axes_are_made_one_or_told() -> None:
    array = placed(("z", {"units": "um"}), ("y", {"units": "mm"}), ("x", {"units": "mm"}), z=500)
    found = Volume.from_xarray(array.assign_coords(z=array.z + 1000))
    np.testing.assert_allclose((*found.spacing, *found.origin), (1, 1, 0.5, 0, 0, 1))
    assert found.unit == "mm"
    back = Volume.from_xarray(found.to_xarray().rename(x="p", y="q", z="r"))
    assert (back.unit, back.origin.tolist(), back.values.tolist()) == ("mm", [0, 0, 1], array.values.tolist())
    mixed = placed(("z", {"units": "m"}), ("lat", {"units": "degrees_north"}), ("x", {}))
    with pytest.warns(UserWarning, match=r"different units \(no unit, degrees_north, m\); spacing=\(x, y, z\)"):
        Volume.from_xarray(mixed)
    assert Volume.from_xarray(mixed, spacing=(1, 2, 3)).spacing.tolist() == [1, 2, 3]  # warns of nothing


def test_curved_coordinates_are_refused_and_one_slice_is_thin() -> None:
    array = placed(("z", {}), ("y", {}), ("x", {}), x=0.25, y=0.5, z=0.5)
    curved = array.drop_vars(["y", "x"]).assign_coords(lat=(("y", "x"), np.ones((3, 4))))
    with pytest.raises(texvol.InputError, match="its coordinates lat must have one dimension, got y, x; texvol.load"):
        Volume.from_xarray(curved)
    assert Volume.from_xarray(array.assign_coords(lat=(("y", "x"), np.ones((3, 4))))).spacing.tolist() == [
        0.25,
        0.5,
        0.5,
    ]
    assert Volume.from_xarray(array.isel(z=[1])).spacing.tolist() == [0.25, 0.5, 0.25]


def test_xarray_in_parts_stays_in_parts() -> None:
    xarray, _ = pytest.importorskip("xarray"), pytest.importorskip("dask.array")
    array = xarray.DataArray(VALUES, dims=("z", "y", "x")).chunk({"z": 2})
    found = Volume.from_xarray(array)
    assert isinstance(found, texvol.LargeVolume)
    np.testing.assert_array_equal(found.whole.values, VALUES)


def test_xarray_has_an_accessor() -> None:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(VALUES.astype(np.float32), dims=("z", "y", "x"))
    np.testing.assert_array_equal(array.texvol.volume().values, VALUES)
    assert array.texvol.render(16).shape == (16, 16, 4)
    stretched = array.assign_coords(z=2.0 * np.arange(array.sizes["z"]))
    np.testing.assert_array_equal(
        stretched.texvol.show(16, interactive=False, tf="ct-bone"), texvol.render(stretched, 16, tf="ct-bone")
    )


def test_xarray_s_accessor_shows_the_window() -> None:
    xarray, _ = pytest.importorskip("xarray"), pytest.importorskip("anywidget")
    array = xarray.DataArray(VALUES.astype(np.float32), dims=("z", "y", "x"), name="field")
    widget = array.texvol.show((24, 16), light="none")
    assert (widget.width, widget.height) == (24, 16)
    np.testing.assert_array_equal(widget.cells.window.scene.volume.values, VALUES)
    assert widget.cells.window.scene.lighting is None
    widget.close()


def test_dlpack_and_array_interfaces() -> None:
    class OnlyDlpack:
        def __dlpack__(self, **how):
            return VALUES.__dlpack__(**how)

        def __dlpack_device__(self):
            return VALUES.__dlpack_device__()

    class OnlyInterface:
        __array_interface__ = VALUES.__array_interface__

    for thing in (OnlyDlpack(), OnlyInterface(), VALUES.tolist(), VALUES):
        np.testing.assert_array_equal(volume_of(thing).values, VALUES)
        np.testing.assert_array_equal(Volume(thing).values, VALUES)
    volume = Volume(VALUES)
    np.testing.assert_array_equal(np.asarray(volume), VALUES)
    np.testing.assert_array_equal(np.from_dlpack(volume), VALUES)


def test_arrays_that_numpy_cannot_read_are_refused() -> None:
    class Elsewhere:
        def __init__(self, **errors: Exception) -> None:
            self.errors = errors

        def __dlpack_device__(self):
            return (2, 0)

        def __dlpack__(self, **_):
            raise self.errors["dlpack"]

    class Tensor(Elsewhere):
        def __array__(self, *_, **__):
            raise TypeError("can't convert cuda:0 device type tensor to numpy")

    errors = BufferError("it requires\ngradient"), RuntimeError("other device"), ValueError("dtype")
    things = [make(dlpack=error) for make in (Elsewhere, Tensor) for error in errors]
    for thing in (*things, [[[1, 2], [3]]]):
        for make in (volume_of, Volume):
            with pytest.raises(
                texvol.InputError, match=r"array must be one that numpy can read, got \w+: .*$"
            ) as caught:
                make(thing)
            assert "\n" not in str(caught.value)
    strided = VALUES[:, ::2, ::-1]
    strided.flags.writeable = False
    np.testing.assert_array_equal(volume_of(strided).values, strided)


def test_a_rectilinear_grid_that_is_even_is_a_volume() -> None:
    pyvista = pytest.importorskip("pyvista")
    nz, ny, nx = VALUES.shape
    grid = pyvista.RectilinearGrid(5 + 2.0 * np.arange(nx), np.arange(ny), 3.0 * np.arange(nz))
    grid["heat"] = VALUES.ravel()
    found = volume_of(grid)
    np.testing.assert_array_equal(found.values, VALUES)
    assert (found.spacing.tolist(), found.origin.tolist()) == ([2, 1, 3], [5, 0, 0])
    uneven = pyvista.RectilinearGrid(np.arange(nx) ** 2.0, np.arange(ny), np.arange(nz) ** 2.0)
    with pytest.raises(texvol.InputError, match="coordinates z of a RectilinearGrid must be even; pyvista's resample"):
        volume_of(uneven)


def test_what_is_no_volume_is_refused() -> None:
    with pytest.raises(texvol.InputError, match="a volume must be a path, .* got dict"):
        volume_of({})
    with pytest.raises(texvol.InputError, match="spacing must be given when it is made"):
        volume_of(Volume(VALUES), spacing=(1, 1, 2))


def test_an_image_says_its_spacing_itself() -> None:
    pytest.importorskip("nibabel")
    with pytest.raises(texvol.InputError, match="'spacing' does not go with Nifti1Image"):
        volume_of(oblique().to_nibabel(), spacing=(1, 1, 2))
